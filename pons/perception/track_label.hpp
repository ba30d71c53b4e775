// What frames have read on one object, and what that is worth.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/time.hpp"

namespace pons::perception {

// Positions are relative to the belt, as the tracker has them. A parcel has one code. Another one in the label's own
// place was misread; in another place of the same object, it is a second label, and no picture says which is its own.
class TrackLabel {
 public:
  // Whole and bare in a frame of a camera that reads labels, and whether that was searched for codes.
  void shown(bool searched);
  // A code and its label's middle. The first sticks; another one in its place replaces it when read twice.
  void read(std::string_view code, const Eigen::Vector2d& middle_m, Time stamp);
  // Two codes at once.
  void read_two(std::string_view code, std::string_view other);
  // Likewise, but one of them may be a neighbour's.
  void suspect(std::string_view code, std::string_view other);

  // It moved with its object: where the label lies now.
  void move(const Eigen::Vector2d& middle_m, Time stamp);
  // Whose it was is no longer known. What was searched before counts no more.
  void drop();
  // Another object turned out to have this code.
  void lose(std::string_view code);

  // Empty: none read, or two.
  [[nodiscard]] const std::string& code() const { return code_; }
  // Both of an object that shows two.
  [[nodiscard]] const std::vector<std::string>& disputed() const { return disputed_; }
  // Both of those that it showed before it was dropped, or is suspected to: that it was two remains to be seen.
  [[nodiscard]] const std::vector<std::string>& once_disputed() const { return once_disputed_; }
  // Where it was read last, and when it lay there; only if there is a code.
  [[nodiscard]] const Eigen::Vector2d& middle_m() const { return middle_m_; }
  [[nodiscard]] Time stamp() const { return stamp_; }
  // Read so often that it is no misreading, with all of the object in sight at least twice: a second one would have
  // been seen.
  [[nodiscard]] bool settled() const;
  // Whole and bare in so many frames.
  [[nodiscard]] int attempts() const { return attempts_; }

 private:
  std::string code_, other_code_;
  std::vector<std::string> disputed_, once_disputed_;
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();
  Time stamp_;
  int reads_ = 0, other_reads_ = 0, attempts_ = 0, searches_ = 0;
};

}  // namespace pons::perception
