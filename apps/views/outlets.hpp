// Where what a run shows of itself goes: to nodes of ROS 2, into a recording, to who looks on. A view makes a message
// once and puts it into an outlet; each sink takes its bytes from there, and a new one needs no other view.
//
// All is called on the bridge's thread. Nothing waits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/gate/ros/participant.hpp"
#include "pons/wire/cdr.hpp"

namespace pons::apps {

// Whom something is for.
enum class Audience {
  kAll,
  kLive,   // not a recording, which has it in another form
  kDepth,  // a recording only where depth was asked for: it makes that several times as large
};
[[nodiscard]] constexpr bool is_recorded(Audience audience, bool depth) {
  return audience == Audience::kAll || (depth && audience == Audience::kDepth);
}

// What a sink needs to know of a topic.
struct ShownTopic {
  std::string name;       // without a slash before it: in the namespace of whoever shows it; after ~/: under his name
  std::string_view type;  // of T, as T::kName
  std::string_view hash;  // RIHS01
  gate::ros::Qos qos;     // transient local: who comes later is shown the last one, too
  Audience audience = Audience::kAll;
  Duration apart = {};  // made some ahead of their time: who hears at once is sent them so far apart
  [[nodiscard]] bool is_ahead() const { return apart > Duration{}; }
};

// How it goes with what a sink passes on.
struct SinkHealth {
  std::uint64_t dropped = 0;   // messages that found no room: never fewer than before
  std::uint64_t findings = 0;  // about who is at the other end, likewise: who does not fit, what cannot be read
  std::string newest = {};     // of those, for people
};

// A sink as /diagnostics tells of it.
struct WayOut {
  std::string name;
  bool is_live = false;  // as Sink::is_live()
  std::function<SinkHealth()> health;
};

class Sink {
 public:
  virtual ~Sink() = default;
  // Before anything is put. The number that the topic has here; one of the same name has the same. Errors: no name; the
  // topic has another type here.
  [[nodiscard]] virtual Expected<std::size_t> add(const ShownTopic& topic) = 0;
  // Whether somebody takes it now. What costs much to make need not be made for nobody.
  [[nodiscard]] virtual bool wants(std::size_t topic) const = 0;
  // CDR with its encapsulation, of run time `now`. What finds no room is dropped and counted.
  virtual void put(std::size_t topic, Time now, std::span<const std::byte> message) = 0;
  // What /diagnostics calls it.
  [[nodiscard]] virtual std::string_view name() const = 0;
  // Whether it depends on who looks on: a recording has nothing of how it goes with that, for the same run again must
  // tell the same.
  [[nodiscard]] virtual bool is_live() const { return true; }
  [[nodiscard]] virtual SinkHealth health() const = 0;
};

class Outlets;

template <wire::Message T>
class Outlet {
 public:
  Outlet(Outlets& outlets, std::size_t topic) : outlets_(&outlets), topic_(topic) {}
  [[nodiscard]] bool wanted() const;
  void put(Time now, const T& message);
  // Likewise, of a T that somebody has encoded before, CDR with its encapsulation.
  void put_encoded(Time now, std::span<const std::byte> message);

 private:
  Outlets* outlets_;
  std::size_t topic_;
};

class Outlets {
 public:
  // Outlives this.
  void add(Sink& sink) { sinks_.push_back(&sink); }
  // Whether there is any.
  [[nodiscard]] bool needed() const { return !sinks_.empty(); }
  // The sinks, of one name the first. They outlive it.
  [[nodiscard]] std::vector<WayOut> ways_out() const;
  // After the sinks. Errors: those of Sink::add().
  template <wire::Message T>
  [[nodiscard]] Expected<Outlet<T>> outlet(std::string name, const gate::ros::Qos& qos = gate::ros::kTopicQos,
                                           Audience audience = Audience::kAll, Duration apart = {}) {
    const auto topic = add(ShownTopic{std::move(name), T::kName, T::kHash, qos, audience, apart});
    return topic ? Expected<Outlet<T>>(Outlet<T>(*this, *topic)) : std::unexpected(topic.error());
  }

 private:
  template <wire::Message T>
  friend class Outlet;
  // Who shows it, by what number.
  using Places = std::vector<std::pair<Sink*, std::size_t>>;
  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic);

  std::vector<Sink*> sinks_;
  std::vector<Places> topics_;
  std::vector<std::byte> bytes_;
};

template <wire::Message T>
bool Outlet<T>::wanted() const {
  for (const auto& [sink, number] : outlets_->topics_[topic_]) {
    if (sink->wants(number)) return true;
  }
  return false;
}

template <wire::Message T>
void Outlet<T>::put(Time now, const T& message) {
  if (!wire::encode(message, outlets_->bytes_)) return;  // longer than its type allows
  put_encoded(now, outlets_->bytes_);
}

template <wire::Message T>
void Outlet<T>::put_encoded(Time now, std::span<const std::byte> message) {
  for (const auto& [sink, number] : outlets_->topics_[topic_]) sink->put(number, now, message);
}

// Something that a run shows of itself.
class View {
 public:
  virtual ~View() = default;
  // Once a period. Waits for nothing.
  virtual void show(Time now) = 0;
};

}  // namespace pons::apps
