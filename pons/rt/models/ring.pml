/* SpscRing (pons/rt/ring.hpp): every element arrives once, in order, whole.
 *
 * A step here is an access to shared memory. The model is sequentially consistent; what release and acquire forbid is
 * modelled by the variants that swap two steps: without the memory order in the source, the machine may do just that.
 * Elements have two halves, so that a torn copy shows. Counters count up for ever, as in the source.
 *
 * Wrong variants, which the check must reject:
 *   PUBLISH_FIRST   the tail is published before the slot is written (a relaxed store of tail_)
 *   FREE_FIRST      the slot is given back before it is copied out (a relaxed store of head_)
 *   ONE_TOO_MANY    a full ring takes one more */
#define CAPACITY 2
#define ELEMENTS 5

byte left[CAPACITY], right[CAPACITY];
byte head = 0, tail = 0;

#ifdef ONE_TOO_MANY
#define IS_FULL(seen) (tail - seen > CAPACITY)
#else
#define IS_FULL(seen) (tail - seen == CAPACITY)
#endif

proctype producer() {
  byte head_seen = 0, i = 0;
  do
  :: i < ELEMENTS ->
     if
     :: IS_FULL(head_seen) ->
        head_seen = head;
        if
        :: IS_FULL(head_seen) -> goto again
        :: else
        fi
     :: else
     fi;
#ifdef PUBLISH_FIRST
     tail = tail + 1;
     left[i % CAPACITY] = i + 1;
     right[i % CAPACITY] = i + 1;
#else
     left[i % CAPACITY] = i + 1;
     right[i % CAPACITY] = i + 1;
     tail = tail + 1;
#endif
     i++;
again: skip
  :: else -> break
  od
}

proctype consumer() {
  byte tail_seen = 0, i = 0, l, r;
  do
  :: i < ELEMENTS ->
     if
     :: head == tail_seen ->
        tail_seen = tail;
        if
        :: head == tail_seen -> goto again
        :: else
        fi
     :: else
     fi;
#ifdef FREE_FIRST
     head = head + 1;
     l = left[i % CAPACITY];
     r = right[i % CAPACITY];
#else
     l = left[i % CAPACITY];
     r = right[i % CAPACITY];
     head = head + 1;
#endif
     assert(l == r && l == i + 1);
     i++;
again: skip
  :: else -> break
  od;
  assert(tail == ELEMENTS && head == ELEMENTS)
}

init { atomic { run producer(); run consumer() } }
