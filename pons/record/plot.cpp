#include "pons/record/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLeft = 44, kRight = 344, kTop = 22, kBottom = 182;
constexpr double kInset = 10;  // of the outermost ranks
constexpr int kTicks = 5, kNames = 6;

std::string shown(double value) { return fmt::format("{:.1f}", value); }

class Scale {
 public:
  Scale(const Axis& axis, double from, double to) : axis_(axis), from_(from), to_(to) {
    if (axis.names.empty()) {
      ticks_ = ticks(axis.least, axis.most, kTicks);
      low_ = ticks_.front();
      high_ = ticks_.back();
    } else {
      const std::size_t last = axis.names.size() - 1;
      high_ = static_cast<double>(std::max<std::size_t>(last, 1));
      const double inset = to > from ? kInset : -kInset;
      from_ += inset;
      to_ -= inset;
      const std::size_t every = std::max<std::size_t>(1, (last + kNames - 1) / kNames);
      for (std::size_t i = 0; i <= last; i += every) ticks_.push_back(static_cast<double>(i));
    }
  }
  [[nodiscard]] double at(double value) const { return from_ + (value - low_) / (high_ - low_) * (to_ - from_); }
  [[nodiscard]] Json tick_views() const {
    Json views = Json::array();
    for (const double tick : ticks_) views.push_back({{"at", shown(at(tick))}, {"text", text(tick)}});
    return views;
  }

 private:
  [[nodiscard]] std::string text(double tick) const {
    if (!axis_.names.empty()) return axis_.names[static_cast<std::size_t>(tick)];
    const double step = ticks_[1] - ticks_[0];
    const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
    return fmt::format("{:.{}f}", tick + 0.0, digits);
  }

  const Axis& axis_;
  double from_, to_, low_ = 0, high_ = 1;
  std::vector<double> ticks_;
};

}  // namespace

std::vector<double> ticks(double low, double high, int most) {
  if (!(high > low)) {
    const double around = std::max(std::abs(low) * 0.1, 1e-6);
    low -= around;
    high += around;
  }
  const double rough = (high - low) / std::max(1, most - 1);
  const double power = std::pow(10, std::floor(std::log10(rough)));
  constexpr std::array<double, 4> kRound{1, 2, 5, 10};
  const auto* const step =
      std::ranges::find_if(kRound, [&](double times) { return times * power >= rough * (1 - 1e-9); });
  const double apart = (step == kRound.end() ? kRound.back() : *step) * power;
  const double first = std::floor(low / apart + 1e-9), last = std::ceil(high / apart - 1e-9);
  std::vector<double> found;
  for (double i = first; i <= last; ++i) found.push_back(i * apart);
  return found;
}

Json view_of(const Plot& plot) {
  const Scale x(plot.x, kLeft, kRight), y(plot.y, kBottom, kTop);
  Json view = {{"title", plot.title},
               {"about", plot.about},
               {"x_label", plot.x.label},
               {"y_label", plot.y.label},
               {"left", kLeft},
               {"right", kRight},
               {"top", kTop},
               {"bottom", kBottom},
               {"plot_width", shown(kRight - kLeft)},
               {"x_ticks", x.tick_views()},
               {"y_ticks", y.tick_views()}};
  view["bands"] = Json::array();
  view["lines"] = Json::array();
  for (const Plot::Level& level : plot.levels) {
    const double top = y.at(level.to);
    if (level.from < level.to) {
      view["bands"].push_back({{"at", shown(top)}, {"height", shown(y.at(level.from) - top)}, {"text", level.label}});
    } else {
      view["lines"].push_back({{"at", shown(top)}, {"text_at", shown(top - 4)}, {"text", level.label}});
    }
  }
  view["dots"] = Json::array();
  for (const Dot& dot : plot.dots) {
    view["dots"].push_back({{"x", shown(x.at(dot.x))},
                            {"y", shown(y.at(dot.y))},
                            {"kind", dot.kind},
                            {"title", dot.title},
                            {"target", dot.target}});
  }
  return view;
}

}  // namespace pons::record
