#include "apps/views/cameras_view.hpp"

#include <gmock/gmock.h>
#include <png.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "apps/jpeg.hpp"
#include "apps/run_recorder.hpp"
#include "pons/record/test_recording.hpp"
#include "tests/views/shown.hpp"

namespace pons::apps {
namespace {

using ::testing::HasSubstr, ::testing::Not;
using wire::sensor_msgs::msg::CameraInfo;
using wire::sensor_msgs::msg::CompressedImage;
using wire::sensor_msgs::msg::Image;

class Looks final : public perception::Sight {
 public:
  void process(const RgbdFrame& frame, const perception::Moment&) override { last = frame.stamp; }
  [[nodiscard]] bool wants_labels() const override { return true; }
  void forget(std::uint32_t track) override { forgotten = track; }
  Time last;
  std::uint32_t forgotten = 0;
};

// A picture that changes slowly from left to right, as JPEG likes it.
RgbdFrame frame_of(const world::CameraSpec& camera, Time stamp) {
  RgbdFrame frame;
  frame.camera = camera.name;
  frame.stamp = stamp;
  frame.intrinsics = world::intrinsics(camera);
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  frame.rgb.resize(3 * pixels);
  frame.depth_m.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto column = static_cast<int>(i) % camera.width;
    frame.rgb[3 * i] = static_cast<std::uint8_t>(255 * column / camera.width);
    frame.rgb[3 * i + 1] = 100;
    frame.rgb[3 * i + 2] = 50;
    frame.depth_m[i] = i == 0 ? 0.0F : 1.25F;
  }
  return frame;
}

class CamerasViewTest : public ::testing::Test {
 protected:
  CamerasViewTest() {
    outlets_.add(shown_);
    world::CameraSpec camera;
    camera.name = "top";
    camera.width = 64;
    camera.height = 48;
    camera.fovy_rad = 1;
    camera.latency_s = 0.1;
    camera.world_from_optical.translation() = Vector3(1, 2, 3);
    world_.cameras = {camera};
  }
  void open(runner::Pace pace) {
    auto opened = CamerasView::open(outlets_, world_, looks_, pace);
    ASSERT_TRUE(opened) << opened.error().line();
    view_ = *std::move(opened);
  }
  template <wire::Message T>
  std::vector<T> take(const std::string& topic) {
    return shown_.take<T>(topic);
  }

  Shown shown_;
  Outlets outlets_;
  world::World world_;
  Looks looks_;
  std::unique_ptr<CamerasView> view_;
  const Time at_ = Time(from_s(2.5));
};

TEST_F(CamerasViewTest, ShowsWhatItSawWhenItIsKnown) {
  open(runner::Pace::kLockstep);
  view_->process(frame_of(world_.cameras[0], at_), {});
  EXPECT_EQ(looks_.last, at_) << "perception looks at it, too";
  view_->show(at_ + from_s(0.09));
  EXPECT_TRUE(take<Image>("top/image_raw").empty()) << "nobody knows of it yet";
  view_->show(at_ + from_s(0.1));

  const auto raw = take<Image>("top/image_raw");
  ASSERT_EQ(raw.size(), 1U);
  EXPECT_EQ(raw[0].header.frame_id, "top_optical_frame");
  EXPECT_EQ(raw[0].header.stamp.sec, 2);
  EXPECT_EQ(raw[0].encoding, "rgb8");
  EXPECT_EQ(raw[0].step, 192U);
  ASSERT_EQ(raw[0].data.size(), 64U * 48 * 3);
  EXPECT_EQ(raw[0].data[4], 100);

  const auto depth = take<Image>("top/depth/image_rect_raw");
  ASSERT_EQ(depth.size(), 1U);
  EXPECT_EQ(depth[0].encoding, "32FC1");
  ASSERT_EQ(depth[0].data.size(), 64U * 48 * 4);
  float first = 0, second = 0;
  std::memcpy(&first, depth[0].data.data(), 4);
  std::memcpy(&second, depth[0].data.data() + 4, 4);
  EXPECT_TRUE(std::isnan(first)) << "not measured";
  EXPECT_EQ(second, 1.25F);

  const auto info = take<CameraInfo>("top/camera_info");
  ASSERT_EQ(info.size(), 1U);
  const Intrinsics lens = world::intrinsics(world_.cameras[0]);
  EXPECT_EQ(info[0].k, (std::array<double, 9>{lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1}));
  EXPECT_EQ(info[0].p[0], lens.fx);
  EXPECT_EQ(info[0].p[10], 1);
  EXPECT_EQ(info[0].distortion_model, "plumb_bob");
  EXPECT_EQ(take<CameraInfo>("top/depth/camera_info").size(), 1U);
  EXPECT_EQ(shown_.topic("top/image_raw").audience, Audience::kLive);
  EXPECT_EQ(shown_.topic("top/image_raw/compressed").audience, Audience::kAll);

  view_->show(at_ + from_s(1));
  EXPECT_TRUE(take<Image>("top/image_raw").empty()) << "once";
}

TEST_F(CamerasViewTest, TheCompressedPictureIsThePicture) {
  open(runner::Pace::kLockstep);
  const RgbdFrame frame = frame_of(world_.cameras[0], at_);
  view_->process(frame, {});
  view_->show(at_ + from_s(1));
  const auto pictures = take<CompressedImage>("top/image_raw/compressed");
  ASSERT_EQ(pictures.size(), 1U);
  EXPECT_THAT(pictures[0].format, HasSubstr("jpeg"));
  EXPECT_EQ(pictures[0].header.frame_id, "top_optical_frame");
  void* const reader = tjInitDecompress();
  std::vector<std::uint8_t> rgb(64UL * 48 * 3);
  const auto& jpeg = pictures[0].data;
  ASSERT_EQ(tjDecompress2(reader, jpeg.data(), jpeg.size(), rgb.data(), 64, 0, 48, TJPF_RGB, 0), 0);
  tjDestroy(reader);
  for (std::size_t i = 0; i < rgb.size(); ++i) ASSERT_NEAR(rgb[i], frame.rgb[i], 8) << i;
  EXPECT_LT(jpeg.size(), rgb.size() / 5);
}

// As image_transport's plugin reads it.
TEST_F(CamerasViewTest, TheCompressedDepthIsTheDepth) {
  open(runner::Pace::kLockstep);
  RgbdFrame frame = frame_of(world_.cameras[0], at_);
  frame.depth_m[2] = 0.8004F, frame.depth_m[3] = 65.536F;
  view_->process(frame, {});
  view_->show(at_ + from_s(1));
  const auto pictures = take<CompressedImage>("top/depth/image_rect_raw/compressedDepth");
  ASSERT_EQ(pictures.size(), 1U);
  EXPECT_EQ(pictures[0].format, "16UC1; compressedDepth png");
  EXPECT_EQ(pictures[0].header.frame_id, "top_optical_frame");
  EXPECT_EQ(shown_.topic("top/depth/image_rect_raw/compressedDepth").audience, Audience::kDepth);
  constexpr std::size_t kHeader = 12;
  ASSERT_GT(pictures[0].data.size(), kHeader);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&image, &pictures[0].data[kHeader], pictures[0].data.size() - kHeader), 0);
  ASSERT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_LINEAR_Y)) << "16 bits, grey";
  ASSERT_EQ(image.width * image.height, 64U * 48);
  std::vector<std::uint16_t> depth_mm(64UL * 48);
  ASSERT_NE(png_image_finish_read(&image, nullptr, depth_mm.data(), 0, nullptr), 0);
  EXPECT_EQ(depth_mm[0], 0) << "not measured";
  EXPECT_EQ(depth_mm[1], 1250);
  EXPECT_EQ(depth_mm[2], 800);
  EXPECT_EQ(depth_mm[3], 0) << "farther than 16 bits go";
}

TEST_F(CamerasViewTest, ARecordingIsTheSameWhoeverLooksOn) {
  const record::TestFolder folder;
  const auto recorded = [&](const std::string& name, std::vector<std::string> unwanted, bool depth = false) {
    const RecordOptions options{.file = folder / name, .depth = depth};
    auto recorder = RunRecorder::open(options, Earlier::kRefused, runner::Pace::kLockstep, 0, {});
    EXPECT_TRUE(recorder) << recorder.error().line();
    Shown viewer;
    viewer.unwanted = std::move(unwanted);
    Outlets outlets;
    outlets.add(**recorder);
    outlets.add(viewer);
    const auto view = CamerasView::open(outlets, world_, looks_, runner::Pace::kLockstep);
    EXPECT_TRUE(view) << view.error().line();
    (*view)->process(frame_of(world_.cameras[0], at_), {});
    (*view)->show(at_ + from_s(1));
    (*recorder)->end("complete", at_ + from_s(1));
    return record::read_bytes(options.file);
  };
  const std::string alone = recorded("a.mcap", {"top/image_raw", "top/depth/image_rect_raw"});
  EXPECT_GT(alone.size(), 1000U);
  EXPECT_TRUE(recorded("b.mcap", {}) == alone);
  EXPECT_THAT(alone, Not(HasSubstr("/top/depth")));
  const std::string deep = recorded("c.mcap", {"top/image_raw", "top/depth/image_rect_raw"}, true);
  EXPECT_THAT(deep, HasSubstr("/top/depth/image_rect_raw/compressedDepth"));
  EXPECT_THAT(deep, HasSubstr("/top/depth/camera_info"));
  EXPECT_TRUE(recorded("d.mcap", {}, true) == deep);
}

TEST_F(CamerasViewTest, MakesNothingForNobody) {
  const std::string depth = "top/depth/image_rect_raw";
  shown_.unwanted = {"top/image_raw", depth, "top/image_raw/compressed", depth + "/compressedDepth"};
  for (const auto pace : {runner::Pace::kLockstep, runner::Pace::kRealTime}) {
    open(pace);
    view_->process(frame_of(world_.cameras[0], at_), {});
    view_->show(at_ + from_s(1));
    EXPECT_EQ(take<CameraInfo>("top/camera_info").size(), 1U);
    EXPECT_TRUE(take<Image>("top/image_raw").empty());
    EXPECT_TRUE(take<CompressedImage>("top/image_raw/compressed").empty());
    EXPECT_TRUE(take<Image>(depth).empty());
    EXPECT_TRUE(take<CompressedImage>(depth + "/compressedDepth").empty());
    EXPECT_TRUE(take<CameraInfo>("top/depth/camera_info").empty());
  }
  // From the moment on that somebody does.
  shown_.unwanted.clear();
  view_->show(at_ + from_s(1));
  open(runner::Pace::kLockstep);
  view_->process(frame_of(world_.cameras[0], at_ + from_s(2)), {});
  view_->show(at_ + from_s(3));
  EXPECT_EQ(take<Image>("top/image_raw").size(), 1U);
}

// The place of the picture is given back at once: it must not be looked at later.
TEST_F(CamerasViewTest, InRealTimeItIsMadeBeside) {
  open(runner::Pace::kRealTime);
  {
    const RgbdFrame frame = frame_of(world_.cameras[0], at_);
    view_->process(frame, {});
  }
  std::vector<Image> raw;
  for (Time now = at_ + from_s(1); raw.empty(); now += from_s(0.01)) {
    view_->show(now);
    raw = take<Image>("top/image_raw");
  }
  EXPECT_EQ(raw[0].data.at(4), 100);
}

TEST_F(CamerasViewTest, InRealTimeEachPictureIsShownOrCounted) {
  open(runner::Pace::kRealTime);
  constexpr std::uint64_t kPictures = 300;
  for (std::uint64_t i = 0; i < kPictures; ++i) view_->process(frame_of(world_.cameras[0], at_), {});
  std::uint64_t shown = 0;
  while (shown + view_->left_out() < kPictures) {
    view_->show(at_ + from_s(1));
    shown += take<Image>("top/image_raw").size();
  }
  EXPECT_EQ(shown + view_->left_out(), kPictures);
}

TEST_F(CamerasViewTest, EachCameraHasItsFrameAndPerceptionIsAskedThrough) {
  open(runner::Pace::kLockstep);
  const auto frames = view_->frames();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].header.frame_id, "world");
  EXPECT_EQ(frames[0].child_frame_id, "top_optical_frame");
  EXPECT_EQ(frames[0].transform.translation.z, 3);
  EXPECT_TRUE(view_->wants_labels());
  view_->forget(7);
  EXPECT_EQ(looks_.forgotten, 7U);
}

TEST(Jpeg, RefusesWhatIsNoPicture) {
  std::vector<std::uint8_t> jpeg;
  const std::vector<std::uint8_t> rgb(300);
  for (const auto& [width, height] : {std::pair{0, 0}, std::pair{10, 11}, std::pair{-10, -10}}) {
    const auto made = encode_jpeg(rgb, width, height, jpeg);
    ASSERT_FALSE(made);
    EXPECT_THAT(made.error().line(), HasSubstr("cannot be made a JPEG"));
  }
  const std::vector<std::uint8_t> wide(3 * 70'000);
  EXPECT_FALSE(encode_jpeg(wide, 70'000, 1, jpeg));
  EXPECT_TRUE(encode_jpeg(rgb, 10, 10, jpeg));
}

}  // namespace
}  // namespace pons::apps
