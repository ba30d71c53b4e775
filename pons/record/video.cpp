#include "pons/record/video.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <vector>

#include "pons/record/posix.hpp"
#include "pons/record/ros_types.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"

namespace pons::record {
namespace {

using wire::sensor_msgs::msg::CompressedImage;

// ffmpeg, which is given pictures one behind the other.
class Film {
 public:
  static Expected<Film> begin(const std::filesystem::path& part, const std::string& codec, double a_second) {
    std::array<int, 2> ends{};
    // Not a pipe: writing to one that nobody reads any more would end this process.
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      return cannot("begin", whole_of(part), errno);
    Descriptor ours(ends[0]), theirs(ends[1]);
    posix_spawn_file_actions_t actions{};
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, theirs.number(), STDIN_FILENO);
    // H.264 wants even sides. A path is a name, whatever is in it: no option, and of no other protocol.
    const std::string file = "file:" + part.string();
    std::vector<std::string> words{"ffmpeg",     "-loglevel",
                                   "error",      "-y",
                                   "-f",         "image2pipe",
                                   "-c:v",       codec,
                                   "-framerate", fmt::format("{:.6f}", a_second),
                                   "-i",         "-",
                                   "-vf",        "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                   "-pix_fmt",   "yuv420p",
                                   "-f",         "mp4",
                                   file};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_t child = -1;
    const int error = ::posix_spawnp(&child, "ffmpeg", &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    const auto path = whole_of(part);
    if (error == ENOENT) return fail("ffmpeg is not installed", path.string(), "install it: apt-get install ffmpeg");
    if (error != 0) return cannot("start ffmpeg", path, error);
    return Film(std::move(ours), child);
  }
  Film(Film&& other) noexcept
      : to_(std::move(other.to_)), child_(std::exchange(other.child_, -1)), took_all_(other.took_all_) {}
  Film& operator=(Film&&) = delete;
  ~Film() { (void)end({}); }

  // False: it takes no more.
  bool add(std::span<const std::uint8_t> picture) {
    while (!picture.empty()) {
      const ssize_t sent = ::send(to_.number(), picture.data(), picture.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) {
        took_all_ = false;
        return false;
      }
      picture = picture.subspan(static_cast<std::size_t>(sent));
    }
    return true;
  }

  // Errors: it has made no film for `path`, or one of a part of what it was given.
  Expected<void> end(const std::filesystem::path& path) {
    if (child_ < 0) return fail("ffmpeg has ended already", path.string());
    ::shutdown(to_.number(), SHUT_WR);
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    // Of what lay there and was not read by the time that nobody could any more, the system makes an error.
    int unread = 0;
    socklen_t size = sizeof unread;
    if (::getsockopt(to_.number(), SOL_SOCKET, SO_ERROR, &unread, &size) != 0 || unread != 0) took_all_ = false;
    to_.close();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
      return fail("ffmpeg has made no film of it", path.string(), "it has said why on the error stream");
    if (!took_all_)
      return fail("ffmpeg has ended before it had read all pictures", path.string(),
                  "see which program is called ffmpeg here, and what it says on the error stream");
    return {};
  }

 private:
  Film(Descriptor to, pid_t child) : to_(std::move(to)), child_(child) {}

  Descriptor to_;
  pid_t child_;
  bool took_all_ = true;  // so far
};

// ffmpeg's name for what made a picture; nothing: it is neither JPEG nor PNG.
std::optional<std::string> codec_of(std::span<const std::uint8_t> picture) {
  constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};
  constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
  const auto begins = [&](const auto& with) {
    return picture.size() > with.size() && std::ranges::equal(picture.first(with.size()), with);
  };
  return begins(kJpeg)  ? std::optional<std::string>("mjpeg")
         : begins(kPng) ? std::optional<std::string>("png")
                        : std::nullopt;
}

Expected<void> expect_pictures(const Contents& contents, const std::string& topic) {
  const auto found =
      std::ranges::find_if(contents.channels, [&](const auto& each) { return each.second.topic == topic; });
  if (found == contents.channels.end())
    return fail("there is no such topic in the recording", topic, "pons recording info shows those that there are");
  const auto type = known_type_of(contents, found->second);
  if (!type) return std::unexpected(type.error());
  if ((*type)->name == CompressedImage::kName) return {};
  return fail(fmt::format("its messages are {}", (*type)->name), topic,
              fmt::format("name a topic of {}", CompressedImage::kName));
}

// How many, and how many a second.
Expected<Filmed> look(const McapReader& reader, const Query& query) {
  Filmed filmed;
  mcap::Timestamp first = ~mcap::Timestamp{0}, last = 0;
  const auto read = reader.each_message(query, [&](const mcap::Message& message, const mcap::Channel&) {
    first = std::min(first, message.log_time);
    last = std::max(last, message.log_time);
    return ++filmed.pictures > 0;
  });
  if (!read) return std::unexpected(read.error());
  filmed.damage = *read;
  constexpr double kSlowest = 0.1, kFastest = 240;
  const double span_s = last > first ? 1e-9 * static_cast<double>(last - first) : 0;
  filmed.a_second = span_s > 0 ? std::clamp(static_cast<double>(filmed.pictures - 1) / span_s, kSlowest, kFastest) : 1;
  return filmed;
}

}  // namespace

Expected<Filmed> export_mp4(const McapReader& reader, const std::string& topic, const std::filesystem::path& path,
                            Overwrite overwrite) {
  if (auto pictures = expect_pictures(reader.contents(), topic); !pictures) return std::unexpected(pictures.error());
  const Query query{.topics = std::set<std::string, std::less<>>{topic}};
  const auto filmed = look(reader, query);
  if (!filmed) return filmed;
  if (filmed->pictures == 0) return fail("it has no pictures", topic, "name a topic that has some");
  if (auto another = check_is_not(reader.source().name(), path); !another) return std::unexpected(another.error());
  const auto part = begin_file(path, overwrite);
  if (!part) return std::unexpected(part.error());

  std::optional<Film> film;
  std::string codec;
  CompressedImage picture;
  Expected<void> done;
  const auto take = [&](const mcap::Message& message, const mcap::Channel&) {
    done = wire::decode(message.data, picture);
    if (!done) return false;
    const auto made_by = codec_of(picture.data);
    if (!made_by || (film && *made_by != codec)) {
      done =
          fail(fmt::format("picture {} is {}", message.sequence, made_by ? "of another kind" : "neither JPEG nor PNG"),
               topic);
      return false;
    }
    if (!film) {
      codec = *made_by;
      auto begun = Film::begin(*part, codec, filmed->a_second);
      if (!begun) {
        done = std::unexpected(begun.error());
        return false;
      }
      film.emplace(std::move(*begun));
    }
    return film->add(picture.data);  // where it takes no more, it has said why
  };
  const auto read = reader.each_message(query, take);
  if (done && film) done = film->end(path);
  film.reset();
  if (!read) done = std::unexpected(read.error());
  if (!done) {
    ::unlink(part->c_str());
    return std::unexpected(done.error());
  }
  if (auto ended = end_file(*part, path, overwrite); !ended) return std::unexpected(ended.error());
  return filmed;
}

}  // namespace pons::record
