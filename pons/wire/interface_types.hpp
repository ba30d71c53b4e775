// Types of interface files that are read when the program runs, as known_types.hpp has those that Pons was built with:
// the same bytes, the same JSON, the same errors.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/wire/interface_file.hpp"
#include "pons/wire/known_types.hpp"

namespace pons::wire {

struct DynamicMessage;

// One thread; the types that it makes need it no longer, and are anybody's.
class InterfaceTypes {
 public:
  // The file of "std_srvs/srv/SetBool". Error, without a place: there is none.
  using Find = std::function<Expected<InterfaceText>(const std::string& interface)>;
  explicit InterfaceTypes(Find find) : find_(std::move(find)) {}

  // Of "std_srvs/srv/SetBool_Request". Errors, of it and of all types that its fields have: that of Find, with the line
  // that asks for it; those of read_interface(); a default that does not fit; a type that contains itself; one that is
  // larger than kLargest.
  [[nodiscard]] Expected<KnownType> type(const std::string& name);

  static constexpr std::size_t kLargest = std::size_t{256} << 10U;  // bytes of a message with nothing in it

 private:
  struct Made {
    std::shared_ptr<const DynamicMessage> blank;
    std::string described;                                           // as REP-2011 does
    std::map<std::string, std::string, std::less<>> refers_to = {};  // those that it needs, likewise
  };
  [[nodiscard]] Expected<const MessageLines*> lines(const std::string& name);
  [[nodiscard]] Expected<const Made*> made(const std::string& name);
  [[nodiscard]] Expected<Made> make(const MessageLines& message);

  Find find_;
  std::map<std::string, std::vector<MessageLines>, std::less<>> files_;  // by interface
  std::map<std::string, Made, std::less<>> made_;
  std::vector<std::string> making_;
};

}  // namespace pons::wire
