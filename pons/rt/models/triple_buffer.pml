/* TripleBuffer (pons/rt/triple_buffer.hpp): the reader gets whole values, never an older one after a newer, and the last
 * one once the writer is done. Neither side ever waits: there is no loop in write() or read().
 *
 * A step is an access to shared memory; an exchange is one step. The model is sequentially consistent; what acq_rel
 * forbids is modelled by the variant that swaps two steps.
 *
 * Wrong variants, which the check must reject:
 *   HAND_OVER_FIRST   the slot is handed over before it is written (a relaxed exchange)
 *   TWO_STEPS         load and store instead of an exchange
 *   ALWAYS_SWAP       the reader swaps although nothing is fresh: it gets an older value back
 *   TWO_SLOTS         no slot in between: the writer takes the reader's */
#define VALUES 4
#define FRESH 4

byte left[3], right[3];
byte between = 1;
bool written = false; /* all of them */

proctype writer() {
  byte mine = 0, value = 1, got;
  do
  :: value <= VALUES ->
#ifndef HAND_OVER_FIRST
     left[mine] = value;
     right[mine] = value;
#endif
#ifdef TWO_STEPS
     got = between;
     between = mine | FRESH;
#else
     atomic { got = between; between = mine | FRESH };
#endif
#ifdef HAND_OVER_FIRST
     left[mine] = value;
     right[mine] = value;
#endif
#ifdef TWO_SLOTS
     mine = 1 - mine;
#else
     mine = got & 3;
#endif
     value++
  :: else -> break
  od;
  written = true
}

proctype reader() {
  byte theirs = 2, last = 0, l, r, seen, got;
  bool newest;
  do
  :: last < VALUES ->
     newest = written;
     seen = between;
     if
#ifdef ALWAYS_SWAP
     :: true ->
#else
     :: (seen & FRESH) ->
#endif
#ifdef TWO_STEPS
        got = between;
        between = theirs;
#else
        atomic { got = between; between = theirs };
#endif
        theirs = got & 3
#ifndef ALWAYS_SWAP
     :: else
#endif
     fi;
     l = left[theirs];
     r = right[theirs];
     assert(l == r);
     assert(l >= last);
     assert(!newest || l == VALUES);
     last = l
  :: else -> break
  od
}

init { atomic { run writer(); run reader() } }
