#include "pons/perception/splitter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace pons::perception {
namespace {

constexpr int kPrintContrast = 60;  // grey levels within five cells
constexpr std::size_t kFewestSamples = 80;
constexpr std::size_t kSamples = 2500;  // cells looked at per object
constexpr double kPlain = 6;            // grey levels: an object of one colour spreads less
constexpr double kExplained = 0.6;
constexpr double kContrast = 14;  // grey levels
constexpr float kGreyPerMillimetre = 5;
constexpr double kSharp = 0.55;      // share of the contrast that must appear right at the line
constexpr double kRectangle = 0.90;  // fuller patches are one box as far as an outline can tell
constexpr double kCornerDepth = 4;   // cells
constexpr double kGain = 0.045;
constexpr double kLengthCost = 0.05;  // of a cut as long as the patch is wide
constexpr double kPrintCost = 0.5;    // likewise, of one through print
constexpr double kTold = 0.2;      // of the variance; what explains less may be shade along an edge or a label's paper,
constexpr double kHinted = 0.03;   // and still less, noise,
constexpr double kStep_m = 0.003;  // unless one side is higher
constexpr double kLeastGain = 0.02;  // where it is known that there are two

double squared(const cv::Vec3d& v) { return v.dot(v); }

cv::Size2d rectangle_size(const std::vector<cv::Point>& points) {
  if (points.size() < 3) return {1, 1};
  std::vector<cv::Point> hull;
  cv::convexHull(points, hull);
  const cv::Size2f size = cv::minAreaRect(hull).size;
  return {static_cast<double>(size.width) + 1, static_cast<double>(size.height) + 1};
}

double rectangle_area(const std::vector<cv::Point>& points) { return rectangle_size(points).area(); }

double narrow_side(const std::vector<cv::Point>& points) {
  const cv::Size2d size = rectangle_size(points);
  return std::min(size.width, size.height);
}

std::vector<cv::Point> outline(const std::vector<cv::Point>& cells) {
  const cv::Rect box = cv::boundingRect(cells);
  cv::Mat1b mask(box.height + 2, box.width + 2, std::uint8_t{0});
  const cv::Point corner = box.tl() - cv::Point(1, 1);
  for (const cv::Point& cell : cells) mask(cell - corner) = 255;
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE, corner);
  if (contours.empty()) return {};
  return *std::ranges::max_element(contours, {}, [](const auto& contour) { return cv::contourArea(contour); });
}

// Lines through inward corners, along the directions of the outline's own edges, and from one inward corner to another.
std::vector<Line> candidates(const std::vector<cv::Point>& contour) {
  std::vector<cv::Point> polygon;
  cv::approxPolyDP(contour, polygon, kCornerDepth * 0.75, true);
  const std::size_t count = polygon.size();
  if (count < 5) return {};
  const double orientation = cv::contourArea(polygon, true) > 0 ? 1 : -1;
  std::vector<cv::Point2d> corners, directions;
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Point2d before = polygon[i] - polygon[(i + count - 1) % count],
                      after = polygon[(i + 1) % count] - polygon[i];
    const double turn = orientation * before.cross(after);
    if (turn < -0.25 * cv::norm(before) * cv::norm(after)) corners.push_back(polygon[i]);
    if (cv::norm(after) > 4 * kCornerDepth) directions.push_back(after / cv::norm(after));
  }
  std::vector<Line> lines;
  const auto add = [&](const cv::Point2d& through, const cv::Point2d& along) {
    const cv::Point2d normal(-along.y, along.x);
    lines.push_back({normal, normal.dot(through)});
  };
  for (std::size_t i = 0; i < corners.size() && lines.size() < 60; ++i) {
    for (const cv::Point2d& along : directions) add(corners[i], along);
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      const cv::Point2d along = corners[j] - corners[i];
      if (cv::norm(along) > kCornerDepth) add(corners[i], along / cv::norm(along));
    }
  }
  return lines;
}

}  // namespace

double rectangle_fill(const std::vector<cv::Point>& cells) {
  return static_cast<double>(cells.size()) / rectangle_area(cells);
}

void Splitter::prepare(const TopView& view) {
  cv::cvtColor(view.colour, grey_, cv::COLOR_RGB2GRAY);
  const cv::Mat kernel = cv::getStructuringElement(cv::MORPH_RECT, {5, 5});
  cv::dilate(grey_, brightest_, kernel);
  cv::erode(grey_, darkest_, kernel);
  cv::subtract(brightest_, darkest_, texture_);
  cv::threshold(texture_, texture_, kPrintContrast, 255, cv::THRESH_BINARY);
  cv::dilate(texture_, texture_, kernel);
}

Splitter::Cut Splitter::best_cut(double angle_rad, double bin, double total_variance, double from, double to) const {
  const auto nx = static_cast<float>(std::cos(angle_rad)), ny = static_cast<float>(std::sin(angle_rad));
  float low = 1e9F, high = -1e9F;
  for (const Sample& sample : samples_) {
    const float s = nx * sample.at.x + ny * sample.at.y;
    low = std::min(low, s), high = std::max(high, s);
  }
  const auto bins = static_cast<std::size_t>((high - low) / bin) + 1;
  std::vector<std::array<float, 4>> sums(bins, {0, 0, 0, 0});
  const auto inverse = static_cast<float>(1 / bin);
  for (const Sample& sample : samples_) {
    auto& sum =
        sums[std::min(bins - 1, static_cast<std::size_t>((nx * sample.at.x + ny * sample.at.y - low) * inverse))];
    sum[0] += 1, sum[1] += sample.colour[0], sum[2] += sample.colour[1], sum[3] += sample.colour[2];
  }
  cv::Vec4d all(0, 0, 0, 0);
  for (const auto& sum : sums) all += cv::Vec4d(sum[0], sum[1], sum[2], sum[3]);
  const double least = std::max(30.0, 0.08 * all[0]);
  Cut best;
  cv::Vec4d left(0, 0, 0, 0);
  for (std::size_t i = 0; i + 1 < bins; ++i) {
    left += cv::Vec4d(sums[i][0], sums[i][1], sums[i][2], sums[i][3]);
    const cv::Vec4d right = all - left;
    if (left[0] < least || right[0] < least) continue;
    const double offset = static_cast<double>(low) + bin * static_cast<double>(i + 1);
    if (offset < from || offset > to) continue;
    const cv::Vec3d difference(left[1] / left[0] - right[1] / right[0], left[2] / left[0] - right[2] / right[0],
                               left[3] / left[0] - right[3] / right[0]);
    const double explained = left[0] * right[0] / (all[0] * all[0]) * squared(difference) / total_variance;
    if (explained > best.explained) {
      best = {angle_rad, offset, explained, std::sqrt(squared(difference))};
    }
  }
  return best;
}

// A shaded curve changes slowly; where two objects meet, the colour jumps.
bool Splitter::sharp(const Cut& cut) const {
  const cv::Point2d normal(std::cos(cut.angle_rad), std::sin(cut.angle_rad));
  cv::Vec3d before(0, 0, 0), after(0, 0, 0);
  int count_before = 0, count_after = 0;
  for (const Sample& sample : samples_) {
    const double s = normal.dot(cv::Point2d(sample.at)) - cut.offset;
    if (s > -9 && s < -1) before += cv::Vec3d(sample.colour), ++count_before;
    if (s > 1 && s < 9) after += cv::Vec3d(sample.colour), ++count_after;
  }
  if (count_before < 5 || count_after < 5)
    return true;  // print or a gap lies between: nothing speaks against two objects
  return std::sqrt(squared(before / count_before - after / count_after)) > kSharp * cut.contrast;
}

// Of plain cells, evenly spread; says how much their features vary.
template <typename Features>
double Splitter::take_samples(const std::vector<cv::Point>& cells, const Features& features) {
  samples_.clear();
  const std::size_t stride = std::max<std::size_t>(1, cells.size() / kSamples);
  cv::Vec3d sum(0, 0, 0);
  double squares = 0;
  for (std::size_t i = 0; i < cells.size(); i += stride) {
    if (texture_(cells[i]) != 0) continue;
    samples_.push_back({cells[i], features(cells[i])});
    sum += cv::Vec3d(samples_.back().colour);
    squares += squared(cv::Vec3d(samples_.back().colour));
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, samples_.size()));
  return squares / count - squared(sum / count);
}

std::optional<Line> Splitter::by_colour(const TopView& view, const std::vector<cv::Point>& cells) {
  const double variance = take_samples(cells, [&](const cv::Point& cell) {
    const cv::Vec3b& colour = view.colour(cell);
    return cv::Vec3f(colour[0], colour[1], colour[2]);
  });
  if (samples_.size() < kFewestSamples || variance < kPlain * kPlain) return std::nullopt;

  constexpr double kDegree = std::numbers::pi / 180;
  Cut best;
  for (int degrees = 0; degrees < 180; degrees += 5) {
    const Cut cut = best_cut(degrees * kDegree, 3, variance);
    if (cut.explained > best.explained) best = cut;
  }
  if (best.explained < 0.8 * kExplained) return std::nullopt;
  const double coarse = best.angle_rad;
  for (int degrees = -4; degrees <= 4; ++degrees) {
    const Cut cut = best_cut(coarse + degrees * kDegree, 1, variance);
    if (cut.explained > best.explained) best = cut;
  }
  if (best.explained < kExplained || best.contrast < kContrast || !sharp(best)) return std::nullopt;
  return Line{{std::cos(best.angle_rad), std::sin(best.angle_rad)}, best.offset};
}

std::optional<Line> Splitter::between(const TopView& view, const std::vector<cv::Point>& cells, const Labels& labels) {
  const auto told = between_colours(view, cells, labels);
  if (told && told->explained >= kTold && told->sharp) return told->line;
  if (auto line = between_corners(cells, labels)) return line;
  if (told && told->explained >= kHinted && told->step_m >= kStep_m) return told->line;
  return std::nullopt;
}

std::optional<Splitter::Told> Splitter::between_colours(const TopView& view, const std::vector<cv::Point>& cells,
                                                        const Labels& labels) {
  const double variance = take_samples(cells, [&](const cv::Point& cell) {
    const cv::Vec3b& colour = view.colour(cell);
    const double height_mm = 1e3 * TopView::metres(view.height(cell));
    return cv::Vec3f(colour[0], colour[2], kGreyPerMillimetre * static_cast<float>(height_mm));
  });
  if (samples_.size() < kFewestSamples) return std::nullopt;

  Cut best;
  for (int degrees = 0; degrees < 180; degrees += 3) {
    const double angle = degrees * std::numbers::pi / 180;
    const cv::Point2d normal(std::cos(angle), std::sin(angle));
    const double a = normal.dot(labels.one), b = normal.dot(labels.other);
    const Cut cut =
        best_cut(angle, 1, std::max(1.0, variance), std::min(a, b) + labels.clear, std::max(a, b) - labels.clear);
    if (cut.explained > best.explained) best = cut;
  }
  if (best.explained <= 0) return std::nullopt;
  const Line line{{std::cos(best.angle_rad), std::sin(best.angle_rad)}, best.offset};
  std::array<double, 2> sum{}, count{};
  for (const Sample& sample : samples_) {
    const std::size_t side = line.beyond(sample.at) ? 1 : 0;
    sum[side] += static_cast<double>(sample.colour[2]) / kGreyPerMillimetre;
    count[side] += 1;
  }
  return Told{line, best.explained, best.contrast >= kContrast && sharp(best),
              1e-3 * std::abs(sum[0] / count[0] - sum[1] / count[1])};
}

std::optional<Line> Splitter::between_corners(const std::vector<cv::Point>& cells, const Labels& labels) {
  const std::vector<cv::Point> contour = outline(cells);
  if (contour.size() < 20) return std::nullopt;
  std::optional<Line> best;
  double best_fill = rectangle_fill(cells) + kLeastGain;
  std::vector<cv::Point> near, far;
  for (const Line& line : candidates(contour)) {
    const double a = line.normal.dot(labels.one) - line.offset, b = line.normal.dot(labels.other) - line.offset;
    if (a * b > 0 || std::min(std::abs(a), std::abs(b)) < labels.clear) continue;
    near.clear(), far.clear();
    for (const cv::Point& point : contour) (line.beyond(point) ? far : near).push_back(point);
    const double fill = static_cast<double>(cells.size()) / (rectangle_area(near) + rectangle_area(far));
    if (fill > best_fill) best_fill = fill, best = line;
  }
  return best;
}

std::optional<Line> Splitter::by_outline(const std::vector<cv::Point>& cells, double narrowest) const {
  if (cells.size() < 300) return std::nullopt;
  const std::vector<cv::Point> contour = outline(cells);
  if (contour.size() < 20) return std::nullopt;
  // Holes (a label's glare, a tear) are no reason to cut: the outline's own area counts.
  const double area = cv::contourArea(contour) + 0.5 * static_cast<double>(contour.size());
  const double whole = area / rectangle_area(contour);
  if (whole > kRectangle) return std::nullopt;

  std::optional<Line> best;
  double best_score = 0;
  const auto total = static_cast<double>(cells.size());
  std::vector<cv::Point> near, far;
  for (const Line& line : candidates(contour)) {
    near.clear(), far.clear();
    for (const cv::Point& point : contour) (line.beyond(point) ? far : near).push_back(point);
    double count_far = 0, length = 0, print = 0;
    for (const cv::Point& cell : cells) {
      const double distance = line.normal.dot(cell) - line.offset;
      count_far += distance > 0 ? 1 : 0;
      if (std::abs(distance) >= 0.5) continue;
      length += 1;
      print += texture_(cell) != 0 ? 1 : 0;
    }
    const double count_near = total - count_far;
    if (std::min(count_far, count_near) < 0.08 * total) continue;
    const double fill_near = count_near / rectangle_area(near), fill_far = count_far / rectangle_area(far);
    const double fill = total / (rectangle_area(near) + rectangle_area(far));
    if (fill < whole + kGain || std::max(fill_near, fill_far) < 0.9 || std::min(fill_near, fill_far) < whole) continue;
    if (std::min(narrow_side(near), narrow_side(far)) < narrowest) continue;
    const double score = fill - kLengthCost * length / std::sqrt(total) - kPrintCost * print / std::sqrt(total);
    if (score > best_score) best_score = score, best = line;
  }
  return best;
}

}  // namespace pons::perception
