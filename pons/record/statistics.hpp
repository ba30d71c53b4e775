// What may be said of figures from a few runs, and what not.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace pons::record {

struct Spread {
  double least = 0, lower_quartile = 0, median = 0, upper_quartile = 0, most = 0;
};

// Quantiles by linear interpolation between the order statistics (definition 7 of Hyndman and Fan, "Sample quantiles in
// statistical packages", The American Statistician 50, 1996). Values that are not finite are left out; nothing of none.
[[nodiscard]] std::optional<Spread> spread(std::vector<double> values);

// The largest share of events among independent trials that would still show at most `events` of `trials` once in
// twenty times: the one-sided upper 95 % bound of Clopper and Pearson ("The use of confidence or fiducial limits
// illustrated in the case of the binomial", Biometrika 26, 1934). For 0 events it is 1 - 0.05^(1/n), close to 3/n: the
// rule of three (Hanley and Lippman-Hand, JAMA 249, 1983). Nothing without trials, or with more events than trials.
[[nodiscard]] std::optional<double> at_most(std::int64_t events, std::int64_t trials);

}  // namespace pons::record
