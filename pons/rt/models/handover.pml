/* SpscRing (pons/rt/ring.hpp) whose producer is killed at any step and followed by another, as link::BridgeEnd does it:
 * the successor takes over the tail as it stands and marks it; the consumer drops what stands before the mark. Elements
 * arrive whole and in order, of the present producer all of them, and of the killed one none once the mark stands: what
 * a pop that began after the taking over brings is the successor's.
 *
 * A step is an access to shared memory. The model is sequentially consistent. Producers say who they are (0, 1) and
 * their elements' numbers; `pushed` is the model's own memory.
 *
 * Wrong variants, which the check must reject:
 *   PUBLISH_FIRST   the tail is published before the slot is written: a killed producer leaves half an element
 *   RESET           the successor empties the ring by setting both counters to 0, under the consumer's hands
 *   OWN_HEAD        the successor takes the killed one's view of a ring that was never full for its own
 *   NO_MARK         the successor marks nothing: it inherits what was queued
 *   STALE_TAIL      the consumer drops elements and keeps its older view of the tail: it pops what is not there */
#define CAPACITY 2
#define ELEMENTS 3

byte left[CAPACITY], right[CAPACITY];
byte head = 0, tail = 0, mark = 0;
byte tail_seen = 0; /* the consumer's, which lives */
byte sender = 0;    /* who has taken over */
byte pushed = 0;    /* by the successor */
bool done = false;

#define IS_FULL(seen) (tail - seen >= CAPACITY)
/* An element: its sender and its number. */
#define ELEMENT(i) (16 * me + i + 1)

#define MAY_BE_KILLED \
  if \
  :: me == 0 -> goto killed \
  :: true \
  fi

inline push(i) {
  do
  :: IS_FULL(head_seen) ->
     head_seen = head;
     if
     :: IS_FULL(head_seen) -> skip
     :: else -> break
     fi
  :: else -> break
  od;
#ifdef PUBLISH_FIRST
  tail = tail + 1;
  MAY_BE_KILLED;
  left[(tail - 1) % CAPACITY] = ELEMENT(i);
  MAY_BE_KILLED;
  right[(tail - 1) % CAPACITY] = ELEMENT(i);
#else
  left[tail % CAPACITY] = ELEMENT(i);
  MAY_BE_KILLED;
  right[tail % CAPACITY] = ELEMENT(i);
  MAY_BE_KILLED;
  tail = tail + 1;
#endif
  MAY_BE_KILLED
}

proctype producers() {
  byte me = 0, i = 0, head_seen = 0;
  do
  :: i < ELEMENTS -> push(i); i++
  :: else -> break
  od;
killed:
  me = 1;
  i = 0;
#ifdef RESET
  head = 0;
  tail = 0;
#endif
#ifdef OWN_HEAD
  head_seen = tail;
#else
  head_seen = head;
#endif
#ifndef NO_MARK
  mark = tail;
#endif
  sender = 1;
  do
  :: i < ELEMENTS -> push(i); i++
  :: else -> break
  od;
  done = true
}

proctype consumer() {
  byte l, r, last = 0, since, from;
  bool over;
  do
  :: true ->
     over = done;
     since = sender;
     from = mark;
     if
     :: from > head ->
        head = from;
#ifndef STALE_TAIL
        if
        :: tail_seen < from -> tail_seen = from
        :: else
        fi
#endif
     :: else
     fi;
     if
     :: head == tail_seen -> tail_seen = tail
     :: else
     fi;
     if
     :: head == tail_seen ->
        if
        :: over -> break
        :: else
        fi
     :: else ->
        l = left[head % CAPACITY];
        r = right[head % CAPACITY];
        head = head + 1;
        assert(l == r && l > last);
        assert(l / 16 >= since);
        assert(l / 16 == last / 16 -> l == last + 1 : l % 16 == 1);
        last = l
     fi
  od;
  assert(last == 16 + ELEMENTS)
}

init { atomic { run producers(); run consumer() } }
