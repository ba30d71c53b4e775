/* TripleBuffer (pons/rt/triple_buffer.hpp): the reader gets whole values, never an older one after a newer, and the last
 * one once the writer is done, although either side may be killed at any step and followed by another that knows nothing
 * but the buffer. Nobody resets anything.
 *
 * A step is an access to shared memory; a compare-and-exchange is one step. `between`, `theirs` and `fresh` are one word.
 * The model is sequentially consistent; what acq_rel forbids is modelled by the variant that swaps two steps. What a
 * killed side had computed is lost: its successor begins at the top. `value` and `last` are the model's own memory.
 *
 * Wrong variants, which the check must reject:
 *   HAND_OVER_FIRST   the slot is handed over before it is written (a relaxed exchange)
 *   TWO_STEPS         load and store instead of a compare-and-exchange
 *   ALWAYS_SWAP       the reader swaps although nothing is fresh: it gets an older value back
 *   TWO_SLOTS         no slot in between: the writer takes the reader's
 *   OWN_INDEX         the reader notes the slot that it got in a variable of its own, a step after the exchange */
#define VALUES 4
#define KILLS 2

byte left[3], right[3];
byte between = 1, theirs = 2;
bool fresh = false;
byte value = 1;  /* being written */
byte kills = 0;
bool written = false; /* all of them */

#define MAY_BE_KILLED \
  if \
  :: kills < KILLS -> kills++; goto killed \
  :: true \
  fi

proctype writer() {
  byte w, b, t;
  bool f, swapped;
killed: skip;
  do
  :: value <= VALUES ->
#ifdef TWO_SLOTS
     w = 1 - (between & 1);
#else
     d_step { w = 3 - between - theirs };
#endif
#ifndef HAND_OVER_FIRST
     left[w] = value;
     MAY_BE_KILLED;
     right[w] = value;
#endif
     MAY_BE_KILLED;
again: skip;
     d_step { b = between; t = theirs; f = fresh };
#ifdef TWO_STEPS
     between = w;
     fresh = true;
#else
     d_step {
       swapped = (between == b && theirs == t && fresh == f);
       if
       :: swapped -> between = w; fresh = true
       :: else
       fi
     };
     if
     :: !swapped -> goto again
     :: else
     fi;
#endif
#ifdef HAND_OVER_FIRST
     left[w] = value;
     right[w] = value;
#endif
     value++;
     MAY_BE_KILLED
  :: else -> break
  od;
  written = true
}

proctype reader() {
  byte l, r, b, t, last = 0;
  bool newest, f, swapped;
killed: skip;
  do
  :: last < VALUES ->
     newest = written;
again: skip;
     d_step { b = between; t = theirs; f = fresh };
     MAY_BE_KILLED;
     if
#ifdef ALWAYS_SWAP
     :: true ->
#else
     :: f ->
#endif
#ifdef TWO_STEPS
        between = t;
        fresh = false;
        theirs = b;
#else
#ifdef OWN_INDEX
        d_step { b = between; between = theirs; fresh = false };
        MAY_BE_KILLED;
        theirs = b;
#else
        d_step {
          swapped = (between == b && theirs == t && fresh == f);
          if
          :: swapped -> between = t; theirs = b; fresh = false
          :: else
          fi
        };
        if
        :: !swapped -> goto again
        :: else
        fi;
#endif
#endif
        MAY_BE_KILLED;
        t = b
#ifndef ALWAYS_SWAP
     :: else
#endif
     fi;
     l = left[t];
     MAY_BE_KILLED;
     r = right[t];
     assert(l == r);
     assert(l >= last);
     assert(!newest || l == VALUES);
     last = l
  :: else -> break
  od
}

init { atomic { run writer(); run reader() } }
