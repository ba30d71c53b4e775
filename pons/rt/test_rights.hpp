// Takes the rights away that real-time conditions need, for tests of how it is without.
#pragma once

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

namespace pons::rt {

// The capabilities are gone from the calling thread for good, and from the programs it starts, be they root's; the
// limits are the whole process's, and come back when this goes.
class WithoutRights {
 public:
  WithoutRights() {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    std::array<__user_cap_data_struct, 2> capabilities{};
    syscall(SYS_capget, &header, capabilities.data());
    constexpr unsigned kTheirs = (1U << CAP_SYS_NICE) | (1U << CAP_IPC_LOCK);
    for (unsigned* set : {&capabilities[0].effective, &capabilities[0].permitted, &capabilities[0].inheritable})
      *set &= ~kTheirs;
    syscall(SYS_capset, &header, capabilities.data());
    // Without this a program of root's, or one with capabilities on its file, has them again.
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    for (Limit& limit : limits_) {
      getrlimit(limit.which, &limit.was);
      const rlimit less{std::min(limit.less, limit.was.rlim_cur), limit.was.rlim_max};
      setrlimit(limit.which, &less);
    }
  }
  ~WithoutRights() {
    for (const Limit& limit : limits_) setrlimit(limit.which, &limit.was);
  }
  WithoutRights(const WithoutRights&) = delete;
  WithoutRights& operator=(const WithoutRights&) = delete;

 private:
  struct Limit {
    decltype(RLIMIT_RTPRIO) which;
    rlim_t less;
    rlimit was{};
  };
  std::array<Limit, 2> limits_{{{RLIMIT_RTPRIO, 0}, {RLIMIT_MEMLOCK, 65'536}}};
};

}  // namespace pons::rt
