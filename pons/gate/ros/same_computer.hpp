// A transport to participants on this computer only. They may be told by any of its addresses: ROS 2's nodes tell that
// of a network interface, as long as nobody confines them. All of these are spoken to over loopback; others are not.
#pragma once

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <memory>

namespace pons::gate::ros {

class SameComputer final : public eprosima::fastdds::rtps::ChainingTransportDescriptor {
 public:
  // Over UDPv4, which must be confined to loopback.
  explicit SameComputer(std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> loopback)
      : ChainingTransportDescriptor(std::move(loopback)) {}
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

}  // namespace pons::gate::ros
