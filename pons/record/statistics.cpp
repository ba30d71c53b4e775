#include "pons/record/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <cstddef>

namespace pons::record {
namespace {

constexpr double kDoubt = 0.05;

// Of sorted values, at least one.
double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

std::optional<Spread> spread(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  return Spread{values.front(), quantile(values, 0.25), quantile(values, 0.5), quantile(values, 0.75), values.back()};
}

std::optional<double> at_most(std::int64_t events, std::int64_t trials) {
  if (trials <= 0 || events < 0 || events > trials) return std::nullopt;
  if (events == trials) return 1.0;  // the library's bound is open there
  return boost::math::binomial_distribution<>::find_upper_bound_on_p(static_cast<double>(trials),
                                                                     static_cast<double>(events), kDoubt);
}

}  // namespace pons::record
