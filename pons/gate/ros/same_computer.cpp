#include "pons/gate/ros/same_computer.hpp"

#include <arpa/inet.h>
#include <fastrtps/utils/IPLocator.h>
#include <ifaddrs.h>
#include <netinet/in.h>

#include <cstring>

namespace pons::gate::ros {
namespace {

namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastdds::rtps::ChainingTransport;
using eprosima::fastdds::rtps::TransportReceiverInterface;

bool is_of_this_computer(const rtps::Locator_t& locator) {
  in_addr wanted{};
  std::memcpy(&wanted, rtps::IPLocator::getIPv4(locator), sizeof(wanted));
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return false;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owned(all, &::freeifaddrs);
  for (const ifaddrs* each = all; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    if (reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr.s_addr == wanted.s_addr) return true;
  }
  return false;
}

class Transport final : public ChainingTransport {
 public:
  explicit Transport(const SameComputer& descriptor) : ChainingTransport(descriptor), descriptor_(descriptor) {}

  // Asked for each address at which a participant or an endpoint says that it listens.
  bool transform_remote_locator(const rtps::Locator_t& remote, rtps::Locator_t& result) const override {
    result = remote;
    if (!IsLocatorSupported(remote)) return false;
    if (rtps::IPLocator::isMulticast(remote)) return low_level_transport_->transform_remote_locator(remote, result);
    if (!rtps::IPLocator::isLocal(remote) && !is_of_this_computer(remote)) return false;
    rtps::IPLocator::setIPv4(result, 127, 0, 0, 1);
    return true;
  }
  bool send(rtps::SenderResource* sender, const rtps::octet* bytes, std::uint32_t size, rtps::LocatorsIterator* begin,
            rtps::LocatorsIterator* end, const std::chrono::steady_clock::time_point& timeout) override {
    return sender->send(bytes, size, begin, end, timeout);
  }
  void receive(TransportReceiverInterface* next, const rtps::octet* bytes, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    next->OnDataReceived(bytes, size, local, remote);
  }
  [[nodiscard]] eprosima::fastdds::rtps::TransportDescriptorInterface* get_configuration() override {
    return &descriptor_;
  }

 private:
  SameComputer descriptor_;
};

}  // namespace

eprosima::fastdds::rtps::TransportInterface* SameComputer::create_transport() const { return new Transport(*this); }

}  // namespace pons::gate::ros
