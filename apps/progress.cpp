#include "apps/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>

namespace pons::apps {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr int kBarWidth = 30;
constexpr std::int64_t kLines = 10;  // plain lines a run

}  // namespace

Progress::Progress(std::FILE* out, std::int64_t total)
    : out_(out),
      total_(total),
      began_(std::chrono::steady_clock::now()),
      drawn_(began_),
      terminal_(isatty(fileno(out)) == 1) {}

void Progress::show(const Figures& figures) {
  const auto now = std::chrono::steady_clock::now();
  const double rate = figures.now.s() > 0 ? 3600.0 * static_cast<double>(figures.sorted) / figures.now.s() : 0;
  if (terminal_) {
    if (now - drawn_ < kRedraw) return;
    drawn_ = now;
    bar(figures, rate);
    return;
  }
  const std::int64_t every = std::max<std::int64_t>(1, total_ / kLines);
  if (figures.done / every == shown_ / every && shown_ >= 0) return;
  shown_ = figures.done;
  const double wall_s = std::chrono::duration<double>(now - began_).count();
  write(fmt::format("{:>6} of {} parcels, {:.0f} an hour, {} waiting, {:.0f} s simulated in {:.0f} s\n", figures.done,
                    total_, rate, figures.queue, figures.now.s(), wall_s));
}

void Progress::bar(const Figures& figures, double rate) {
  const double share = total_ > 0 ? std::min(1.0, static_cast<double>(figures.done) / static_cast<double>(total_)) : 0;
  const int filled = static_cast<int>(share * kBarWidth);
  std::string text(static_cast<std::size_t>(filled), '#');
  text.append(static_cast<std::size_t>(kBarWidth - filled), '.');
  const double wall_s = std::chrono::duration<double>(drawn_ - began_).count();
  write(fmt::format("\r[{}] {}/{} parcels  {:.0f}/h  queue {}  {:.0f} s simulated, {:.1f}x real time\x1b[K", text,
                    figures.done, total_, rate, figures.queue, figures.now.s(),
                    wall_s > 0 ? figures.now.s() / wall_s : 0.0));
  shown_ = figures.done;
}

void Progress::put(std::string_view line) { write(fmt::format("{}{}", terminal_ ? "\r\x1b[K" : "", line)); }

void Progress::finish() {
  if (terminal_ && shown_ >= 0) write("\n");
}

// A terminal that has gone or a full disk must not end a run: fmt would throw.
void Progress::write(const std::string& text) {
  (void)std::fputs(text.c_str(), out_);
  (void)std::fflush(out_);
}

}  // namespace pons::apps
