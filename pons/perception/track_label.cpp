#include "pons/perception/track_label.hpp"

#include <utility>

namespace pons::perception {
namespace {

constexpr int kReads = 2;     // of one code until it is sure
constexpr int kSearches = 2;  // of the whole object, until it shows no other
constexpr double kOwnPlace_m = 0.03;

}  // namespace

void TrackLabel::shown(bool searched) {
  ++attempts_;
  if (searched) ++searches_;
}

void TrackLabel::read(std::string_view code, const Eigen::Vector2d& middle_m, Time stamp) {
  if (!disputed_.empty()) return;
  if (code_.empty() || code_ == code) {
    code_ = code;
    ++reads_;
    other_reads_ = 0;
  } else if ((middle_m - middle_m_).norm() > kOwnPlace_m) {
    return read_two(std::string(code_), code);
  } else {
    other_reads_ = other_code_ == code ? other_reads_ + 1 : 1;
    other_code_ = code;
    if (other_reads_ < kReads) return;
    std::swap(code_, other_code_);
    reads_ = std::exchange(other_reads_, 0);
  }
  move(middle_m, stamp);
}

void TrackLabel::read_two(std::string_view code, std::string_view other) {
  disputed_ = {std::string(code), std::string(other)};
  code_.clear();
  reads_ = other_reads_ = 0;
}

void TrackLabel::suspect(std::string_view code, std::string_view other) {
  once_disputed_ = {std::string(code), std::string(other)};
}

void TrackLabel::move(const Eigen::Vector2d& middle_m, Time stamp) {
  middle_m_ = middle_m;
  stamp_ = stamp;
}

void TrackLabel::drop() {
  code_.clear();
  if (!disputed_.empty()) once_disputed_ = std::exchange(disputed_, {});
  reads_ = attempts_ = searches_ = 0;
}

void TrackLabel::lose(std::string_view code) {
  if (code_ != code) return;
  code_.clear();
  reads_ = 0;
}

bool TrackLabel::settled() const { return !disputed_.empty() || (reads_ >= kReads && searches_ >= kSearches); }

}  // namespace pons::perception
