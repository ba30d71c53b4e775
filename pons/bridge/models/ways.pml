/* Ways of the arbiter (pons/bridge/schedule/arbiter.hpp): what either of two arms can do, each with what it needs there,
 * and each only while it fits, as while the parcel is within its reach. No resource is in use by two tasks. Nobody is
 * granted anything that one waits for who comes before it and fits. Nothing is kept for who does not fit: who fits in a
 * way that is free, and that nobody before it waits for, is granted it. Who fits and is urgent is made way for by those
 * who hold one of its ways, where they count less, and by nobody else. Who has begun in one way goes on in that one.
 *
 * Three tasks, each of which comes again as often as it likes, and ends at any time; the latter two are urgent. Each
 * can be done by the left arm, by either arm, by the left one with the zone between them, or by either one with that, or
 * needs the zone alone. At first one more task may run, which counts as much as any. The world changes at any time what
 * fits. Those that wait for the same are a lane, as they are there. How long anybody waits is claims.pml's matter: here
 * urgent ones come first, and otherwise who came first. Nobody comes to count as urgent by its age, which has it take
 * turns with those that never end (Arbiter.AllThatNeverEndHaveTheirTurns).
 *
 * Wrong variants, which the check must reject:
 *   LANE_ENDS       a lane is passed over when nobody in it can be granted anything, before one in it was found who fits
 *   HEAD_ONLY       way is made for the first of a lane only, though it may not fit, or fit in fewer ways
 *   MISFITS_KEEP    what does not fit is kept for who waits as well
 *   ONE_WAY_KEPT    of the ways of one that waits only the first that fits is kept for it
 *   EVERY_WAY       who holds any way that fits makes way, not only who holds the first that can be had
 *   WANDERS         who has made way takes whichever of its ways is free then */
#define TASKS 3
#define NOBODY TASKS
#define LEFT 1
#define RIGHT 2
#define ZONE 4

#define AWAY 0
#define WAITS 1
#define RUNS 2

#define ONE(t) (1 << (t))

byte stage[TASKS], way[TASKS * 2]; /* what each way needs; 0: there is none */
bool fits[TASKS * 2];
byte has[TASKS];                   /* who runs holds it */
byte came[TASKS];                  /* after so many of those that are there */
bool told[TASKS];                  /* to make way */
byte held = 0, at_first = 0;       /* by all; by the one that is there at first */
bool changed = false;

byte uses[TASKS], began_in[TASKS]; /* the model's own memory */

#define IS_URGENT(t) (t > 0)
#define BEFORE(a, b) (IS_URGENT(a) > IS_URGENT(b) || (IS_URGENT(a) == IS_URGENT(b) && came[a] < came[b]))
#define FITS(t, w) (way[2 * (t) + w] != 0 && fits[2 * (t) + w])
#define NEEDS(t, w) (way[2 * (t) + w])
#define WAITED_FOR(t, w) (FITS(t, w) -> NEEDS(t, w) : 0)
#define KEEPS(t) (WAITED_FOR(t, 0) | WAITED_FOR(t, 1))
#define SAME_LANE(a, b) (NEEDS(a, 0) == NEEDS(b, 0) && NEEDS(a, 1) == NEEDS(b, 1))
#define LANE(t) ((SAME_LANE(0, t) -> 1 : 0) | (SAME_LANE(1, t) -> 2 : 0) | (SAME_LANE(2, t) -> 4 : 0))

/* What those keep who wait before t. */
#define KEPT_BY(a, t) (stage[a] == WAITS && a != t && BEFORE(a, t) -> KEEPS(a) : 0)
#define KEPT_FROM(t) (KEPT_BY(0, t) | KEPT_BY(1, t) | KEPT_BY(2, t))

/* ---- a tick ---- */

/* Of those that wait and were not looked at, nor is their lane passed. */
inline find_first() {
  first = NOBODY;
  t = 0;
  do
  :: t < TASKS ->
     if
     :: stage[t] == WAITS && !(looked & ONE(t)) && (first == NOBODY || BEFORE(t, first)) -> first = t
     :: else
     fi;
     t++
  :: else -> break
  od
}

#define IS_FREE(w) (NEEDS(first, w) != 0 && !(NEEDS(first, w) & taken))
#ifdef LANE_ENDS
#define HAS_LEFT(w) IS_FREE(w)
#else
#define HAS_LEFT(w) ((NEEDS(first, w) & (7 - taken)) != 0)
#endif

inline start(w) {
  assert(!(KEPT_FROM(first) & NEEDS(first, w)));
  assert(!((uses[0] | uses[1] | uses[2] | at_first) & NEEDS(first, w)));
  assert(began_in[first] == 0 || began_in[first] == NEEDS(first, w));
  stage[first] = RUNS;
  has[first] = NEEDS(first, w);
  began_in[first] = has[first];
  uses[first] = has[first];
  held = held | has[first];
  taken = taken | has[first];
#ifndef WANDERS
  way[2 * first] = has[first];
  way[2 * first + 1] = 0;
  fits[2 * first] = fits[2 * first + w];
#endif
}

#ifdef MISFITS_KEEP
#define TO_KEEP (NEEDS(first, 0) | NEEDS(first, 1))
#else
#ifdef ONE_WAY_KEPT
#define TO_KEEP (FITS(first, 0) -> NEEDS(first, 0) : WAITED_FOR(first, 1))
#else
#define TO_KEEP KEEPS(first)
#endif
#endif

inline grant() {
  taken = held;
  looked = 0;
  do
  :: true ->
     find_first();
     if
     :: first == NOBODY -> break
     :: else
     fi;
     looked = looked | ONE(first);
     lane = LANE(first);
     left = HAS_LEFT(0) || HAS_LEFT(1);
     if
     :: FITS(first, 0) && IS_FREE(0) -> start(0)
     :: else ->
        if
        :: FITS(first, 1) && IS_FREE(1) -> start(1)
        :: else ->
           taken = taken | TO_KEEP;
           left = HAS_LEFT(0) || HAS_LEFT(1)
        fi
     fi;
     looked = looked | (left -> 0 : lane)
  od
}

#define COULD_HAVE(t, w) (FITS(t, w) && !(NEEDS(t, w) & (held | KEPT_FROM(t))))

inline nothing_is_left_lying(t) { assert(stage[t] != WAITS || !(COULD_HAVE(t, 0) || COULD_HAVE(t, 1))) }

/* ---- who makes way ---- */

#define HOLDS(t, needs) (stage[t] == RUNS && (has[t] & needs))
#define COUNTS_AS_MUCH(needs) (HOLDS(1, needs) || HOLDS(2, needs) || (at_first & needs))
/* By making way, and not by keeping others waiting longer. */
#define FIRST_CAN_BE_HAD(t, from) (FITS(t, 0) && !(from & NEEDS(t, 0)) && !COUNTS_AS_MUCH(NEEDS(t, 0)))
#define OTHER_CAN_BE_HAD(t, from) \
  (FITS(t, 1) && !((from | WAITED_FOR(t, 0)) & NEEDS(t, 1)) && !COUNTS_AS_MUCH(NEEDS(t, 1)))
#define CAN_BE_HAD(t, from) \
  (FIRST_CAN_BE_HAD(t, from) -> NEEDS(t, 0) : (OTHER_CAN_BE_HAD(t, from) -> NEEDS(t, 1) : 0))
#define CLAIMS(t, from) (FIRST_CAN_BE_HAD(t, from) -> NEEDS(t, 0) : KEEPS(t))

/* Of the two urgent ones the other, if it comes before. */
#define CLAIMED_BEFORE(t) (stage[3 - t] == WAITS && BEFORE(3 - t, t) -> CLAIMS(3 - t, 0) : 0)

/* Those who hold any of `needs`. */
inline tell() {
  before = CLAIMED_BEFORE(first);
  before = CAN_BE_HAD(first, before);
  if
  :: HOLDS(0, needs) -> assert(HOLDS(0, before)); told[0] = true
  :: else
  fi
}

#ifdef HEAD_ONLY
#define CLAIMS_REST(w) false
#else
#define CLAIMS_REST(w) ((NEEDS(first, w) & (7 - taken)) != 0)
#endif

inline preempt() {
  taken = 0; /* claimed by those before */
  looked = ONE(0); /* it is not urgent, and nobody behind it is */
  do
  :: true ->
     find_first();
     if
     :: first == NOBODY -> break
     :: else
     fi;
     looked = looked | ONE(first);
     needs = CAN_BE_HAD(first, taken);
#ifdef EVERY_WAY
     needs = KEEPS(first);
#endif
     tell();
     taken = taken | CLAIMS(first, taken);
     looked = looked | (CLAIMS_REST(0) || CLAIMS_REST(1) -> 0 : LANE(first))
  od
}

inline way_is_made_for(t) {
  before = CLAIMED_BEFORE(t);
  needs = CAN_BE_HAD(t, before);
  assert(stage[t] != WAITS || !HOLDS(0, needs) || told[0])
}

proctype bridge() {
  byte t, first, taken, looked, lane, before, needs;
  bool left;
end:
  do
  :: d_step {
       changed -> changed = false;
       grant();
       nothing_is_left_lying(0);
       nothing_is_left_lying(1);
       nothing_is_left_lying(2);
       preempt();
       way_is_made_for(1);
       way_is_made_for(2);
       t = 0; first = 0; taken = 0; looked = 0; lane = 0; before = 0; needs = 0; left = false
     }
  od
}

/* ---- events ---- */

#define MOVE_UP(t) \
  if \
  :: stage[t] != AWAY && came[t] > came[me] -> came[t]-- \
  :: else \
  fi

#define CAN_BE_DONE(one, other) way[2 * me] = one; way[2 * me + 1] = other

inline gives_back() {
  held = held & ~has[me];
  has[me] = 0; uses[me] = 0; told[me] = false;
  changed = true
}

proctype task(byte me) {
end:
  do
  :: atomic {
       if
       :: CAN_BE_DONE(LEFT, 0)
       :: CAN_BE_DONE(LEFT, RIGHT)
       :: CAN_BE_DONE(LEFT | ZONE, 0)
       :: CAN_BE_DONE(LEFT | ZONE, RIGHT | ZONE)
       :: CAN_BE_DONE(ZONE, 0)
       fi;
       stage[me] = WAITS;
       came[me] = (stage[0] != AWAY) + (stage[1] != AWAY) + (stage[2] != AWAY) - 1;
       changed = true
     };
     do
     :: d_step {
          stage[me] == RUNS ->
          gives_back();
          MOVE_UP(0);
          MOVE_UP(1);
          MOVE_UP(2);
          stage[me] = AWAY;
          way[2 * me] = 0; way[2 * me + 1] = 0; fits[2 * me] = false; fits[2 * me + 1] = false;
          came[me] = 0; began_in[me] = 0
        };
        break
     :: d_step { stage[me] == RUNS && told[me] -> gives_back(); stage[me] = WAITS }
     od
  od
}

/* What waits may fit, or not; what runs is not asked. */
#define TURNS(i) d_step { stage[i / 2] == WAITS && way[i] != 0 -> fits[i] = 1 - fits[i]; changed = true }

proctype the_world() {
end:
  do
  :: TURNS(0)
  :: TURNS(1)
  :: TURNS(2)
  :: TURNS(3)
  :: TURNS(4)
  :: TURNS(5)
  :: d_step { at_first != 0 -> held = held & ~at_first; at_first = 0; changed = true }
  od
}

init {
  atomic {
    if
    :: at_first = 0
    :: at_first = LEFT
    :: at_first = RIGHT
    :: at_first = ZONE
    fi;
    held = at_first;
    run bridge();
    run task(0);
    run task(1);
    run task(2);
    run the_world()
  }
}
