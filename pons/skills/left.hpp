// What the arm laid down on the belt, and no camera has seen since.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pons/core/belief.hpp"

namespace pons::skills {

// Takes out of `left` what is seen again among `objects`: by its code, or, unread, just where it was laid down, for
// nothing else can have come to lie there; that track's code is kept in `labelled` then. Takes out, too, what lies
// there no more: another with a code of its own is seen in its stead, whole and as high.
void recognise_left(std::vector<ObjectBelief>& left, const std::vector<ObjectBelief>& objects,
                    std::map<std::uint32_t, std::string>& labelled);

}  // namespace pons::skills
