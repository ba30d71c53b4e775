#pragma once

namespace pons {

// Downwards; the simulator's, too.
inline constexpr double kGravity_m_s2 = 9.81;

}  // namespace pons
