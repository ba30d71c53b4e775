// What the loop calls in a tick promises not to block: a pointer that may only lead to such functions leads to each.
// That promise is what RealtimeSanitizer watches; without it, it would watch nothing and find nothing. Compiled by
// clang alone.
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/realtime.hpp"
#include "pons/rt/guard.hpp"

namespace pons::tests {

using Step = void (cerebellum::Cerebellum::*)(Time, const body::Sensors&, link::CerebellumEnd&,
                                              body::SetPoints&) PONS_NONBLOCKING;
using Mark = void (*)() PONS_NONBLOCKING;

extern const Step kStep;
extern const Mark kMarks[];
const Step kStep = &cerebellum::Cerebellum::step;
const Mark kMarks[] = {&pons_tick_begin, &pons_tick_end};

}  // namespace pons::tests
