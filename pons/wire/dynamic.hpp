// A message whose type is known only when the program runs. Its fields hold what those of the structs hold that
// tools/ros_codecs makes, and it shows them to the same visitors: so it is read, written, and refused as they are. Any
// thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "pons/wire/cdr.hpp"

namespace pons::wire {

struct DynamicField {
  std::string name;
  std::optional<AtMost> most = {};  // of a text or a sequence
};
struct DynamicValue;

struct DynamicMessage {
  // A message may hold messages: what it is made of is complete only below.
  explicit DynamicMessage(std::shared_ptr<const std::vector<DynamicField>> of = nullptr);
  DynamicMessage(const DynamicMessage& other);
  DynamicMessage(DynamicMessage&& other) noexcept;
  DynamicMessage& operator=(const DynamicMessage& other);
  DynamicMessage& operator=(DynamicMessage&& other) noexcept;
  ~DynamicMessage();

  static constexpr std::string_view kName = "";  // messages of any type are of this one
  std::shared_ptr<const std::vector<DynamicField>> fields;
  std::vector<DynamicValue> values;  // one for each of them

  template <typename Self, typename Visit>
  static void each_field(Self& self, Visit& visit);
};

// Messages that are all of one type.
class DynamicSequence : public std::vector<DynamicMessage> {
 public:
  explicit DynamicSequence(std::shared_ptr<const DynamicMessage> blank) : blank_(std::move(blank)) {}
  // One that nobody has written into yet.
  [[nodiscard]] const DynamicMessage& blank() const { return *blank_; }

 private:
  std::shared_ptr<const DynamicMessage> blank_;
};

template <typename... T>
using OneOrSeveral =
    std::variant<T..., Fixed<T>..., std::vector<T>..., DynamicMessage, Fixed<DynamicMessage>, DynamicSequence>;

struct DynamicValue {
  OneOrSeveral<bool, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t, std::uint32_t, std::int64_t,
               std::uint64_t, float, double, std::string>
      held;
};

inline DynamicMessage::DynamicMessage(std::shared_ptr<const std::vector<DynamicField>> of) : fields(std::move(of)) {}
inline DynamicMessage::DynamicMessage(const DynamicMessage& other) = default;
inline DynamicMessage::DynamicMessage(DynamicMessage&& other) noexcept = default;
inline DynamicMessage& DynamicMessage::operator=(const DynamicMessage& other) = default;
inline DynamicMessage& DynamicMessage::operator=(DynamicMessage&& other) noexcept = default;
inline DynamicMessage::~DynamicMessage() = default;

template <typename Self, typename Visit>
void DynamicMessage::each_field(Self& self, Visit& visit) {
  for (std::size_t i = 0; i < self.values.size(); ++i) {
    const DynamicField& field = (*self.fields)[i];
    const auto show = [&](auto& value) {
      if constexpr (requires { value.size(); }) {
        if (field.most) return visit(field.name, value, *field.most);
      }
      visit(field.name, value);
    };
    std::visit(show, self.values[i].held);
  }
}

}  // namespace pons::wire
