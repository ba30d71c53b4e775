#include "apps/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>

namespace pons::apps {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr int kBarWidth = 30;
constexpr std::int64_t kLines = 10;  // plain lines a run

// A terminal that has gone or a full disk must not end a run: fmt would throw.
void write(std::FILE* out, const std::string& text) {
  (void)std::fputs(text.c_str(), out);
  (void)std::fflush(out);
}

}  // namespace

StatusLine::StatusLine(std::FILE* out) : out_(out), terminal_(isatty(fileno(out)) == 1) {}

bool StatusLine::draw(std::string_view text) {
  const auto now = std::chrono::steady_clock::now();
  if (!terminal_ || (drawn_ && now - drawn_at_ < kRedraw)) return false;
  drawn_at_ = now;
  drawn_ = true;
  write(out_, fmt::format("\r{}\x1b[K", text));
  return true;
}

void StatusLine::put(std::string_view line) { write(out_, fmt::format("{}{}", terminal_ ? "\r\x1b[K" : "", line)); }

void StatusLine::finish() {
  if (drawn_) write(out_, "\n");
  drawn_ = false;
}

Progress::Progress(std::FILE* out, std::int64_t total)
    : line_(out), total_(total), began_(std::chrono::steady_clock::now()) {}

void Progress::show(const Figures& figures) {
  const double rate = figures.now.s() > 0 ? 3600.0 * static_cast<double>(figures.sorted) / figures.now.s() : 0;
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  if (line_.terminal()) {
    (void)line_.draw(bar(figures, rate, wall_s));
    return;
  }
  const std::int64_t every = std::max<std::int64_t>(1, total_ / kLines);
  if (figures.done / every == shown_ / every && shown_ >= 0) return;
  shown_ = figures.done;
  line_.put(fmt::format("{:>6} of {} parcels, {:.0f} an hour, {} waiting, {:.0f} s simulated in {:.0f} s\n",
                        figures.done, total_, rate, figures.queue, figures.now.s(), wall_s));
}

std::string Progress::bar(const Figures& figures, double rate, double wall_s) const {
  const double share = total_ > 0 ? std::min(1.0, static_cast<double>(figures.done) / static_cast<double>(total_)) : 0;
  const int filled = static_cast<int>(share * kBarWidth);
  std::string text(static_cast<std::size_t>(filled), '#');
  text.append(static_cast<std::size_t>(kBarWidth - filled), '.');
  return fmt::format("[{}] {}/{} parcels  {:.0f}/h  queue {}  {:.0f} s simulated, {:.1f}x real time", text,
                     figures.done, total_, rate, figures.queue, figures.now.s(),
                     wall_s > 0 ? figures.now.s() / wall_s : 0.0);
}

}  // namespace pons::apps
