/* Frames (pons/link/frames.hpp): places for camera frames that change hands. Every frame that a bridge looks at is whole
 * and stays so while it looks, and none comes after a younger one, although a bridge may be killed at any step and
 * followed by another; the body never waits.
 *
 * A step is an access to shared memory. The model is sequentially consistent. Two cameras; a frame's number is its
 * stamp. `last` and `in_use` are the model's own memory.
 *
 * Wrong variants, which the check must reject:
 *   HAND_OVER_FIRST   a place is handed over before its last pixel is written (a relaxed store)
 *   GIVE_BACK_FIRST   it is given back before the last look at it (a relaxed store)
 *   ONE_LOOK          the bridge takes the oldest of a single look at all places
 *   FREE_ALL          a new bridge frees every place, those too that the body holds
 *   KEEP              a new bridge goes on with what the dead one held: it may look at a frame for the second time */
#define CAMERAS 2
#define FRAMES 4
#define KILLS 1
#define NOBODY 0
#define BODY 1
#define BRIDGE 2

byte holder[CAMERAS], stamp[CAMERAS], left[CAMERAS], right[CAMERAS];
byte opened = 0, kills = 0;
bool closed = false, done = false;
chan shots = [CAMERAS] of { byte };  /* inside the body's process */

#define MAY_BE_KILLED \
  if \
  :: kills < KILLS -> kills++; goto killed \
  :: true \
  fi

proctype shutters() {
  byte c;
  do
  :: opened < FRAMES ->
     c = opened % CAMERAS;
     if
     :: holder[c] == NOBODY ->
        opened++;
        stamp[c] = opened;
        holder[c] = BODY;
        shots ! c
     :: else -> skip /* skipped */
     fi
  :: else -> break
  od;
  closed = true
}

proctype developer() {
  byte c;
  do
  :: shots ? c ->
     left[c] = stamp[c];
#ifdef HAND_OVER_FIRST
     holder[c] = BRIDGE;
     right[c] = stamp[c]
#else
     right[c] = stamp[c];
     holder[c] = BRIDGE
#endif
  :: closed && empty(shots) -> break
  od;
  done = true
}

#define LOOK(c) \
  if \
  :: holder[c] == BRIDGE && (first == CAMERAS || stamp[c] < stamp[first]) -> first = c \
  :: else \
  fi

proctype bridge() {
  byte c, first, last = 0, s, l, r;
  bool over;
killed: skip;
  c = 0;
  do
  :: c < CAMERAS ->
#ifdef FREE_ALL
     holder[c] = NOBODY;
#else
#ifndef KEEP
     if
     :: holder[c] == BRIDGE -> holder[c] = NOBODY
     :: else
     fi;
#endif
#endif
     c++
  :: else -> break
  od;
  do
  :: true ->
     over = done;
     first = CAMERAS;
     LOOK(0);
     LOOK(1);
#ifndef ONE_LOOK
     if
     :: first < CAMERAS -> LOOK(0); LOOK(1)
     :: else
     fi;
#endif
     MAY_BE_KILLED;
     if
     :: first == CAMERAS ->
        if
        :: over -> break
        :: else
        fi
     :: else ->
        s = stamp[first];
        l = left[first];
        MAY_BE_KILLED;
#ifdef GIVE_BACK_FIRST
        holder[first] = NOBODY;
        r = right[first];
#else
        r = right[first];
#endif
        assert(l == s && r == s && s > last);
        last = s;
        MAY_BE_KILLED;
        holder[first] = NOBODY
     fi
  od;
  assert(last == FRAMES || kills > 0)
}

init { atomic { run shutters(); run developer(); run bridge() } }
