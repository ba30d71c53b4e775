/* Seats of the arbiter (pons/bridge/schedule/arbiter.hpp): what needs no resource, as a tree that goes round for ever,
 * sits while it runs. Nobody starves, even where no one who sits ever ends: who waits gets a seat within LONGEST periods
 * of ageing, however many more important ones keep coming. A turn is one: who counts most, however it came to that, has
 * its seat for a period at least. Nobody stands up for nothing: who did is not granted a seat before the one that it
 * stood up for. And no seat is empty while somebody waits.
 *
 * Three tasks, each of which comes again as often as it likes. Task t counts t; with a deadline or without. The last one
 * is urgent. Who sits ends at any time or never. Time is counted in periods of ageing, which are the same for all; within
 * a period events come in any order, and who is told to stand up does so. `late` and `stood_for` are the model's own
 * memory.
 *
 * Not here: one that a person has paused keeps its seat as long as that person wants.
 *
 * Wrong variants, which the check must reject:
 *   NO_TURNS         only an urgent task gets the seat of another: who goes round for ever keeps its own
 *   KEEPS_ITS_PLACE  who stood up waits where its acceptance puts it: its seat is its own again
 *   STILL_HURRIES    the deadline of one that has begun counts, though it is met: likewise
 *   ALL_GIVE_WAY     those too give way to an urgent task that count as much by now
 *   SITTERS_AGE      who sits grows older: it stands up for the urgent one, and is before it again
 *   LEAST_KEEPS      whose turn is over does not stand up for one that counts as much */
#define TASKS 3
#define SEATS 1
#define NOBODY TASKS
#define URGENT 2
#define MOST 3 /* above what any task counts by itself */
#define LONGEST 3 /* no less holds */

#define AWAY 0
#define WAITS 1
#define SITS 2

byte stage[TASKS];
bool told[TASKS];    /* to stand up */
bool begun[TASKS];
bool hurries[TASKS];
byte waited[TASKS];  /* so many periods, in all */
bool settled[TASKS]; /* for a period it has waited, or sat, since it last did something else */
byte came[TASKS];    /* after so many of those that are there */
byte counted[TASKS]; /* so much when it sat down */
byte seated = 0;
bool changed = false;

byte late[TASKS], stood_for[TASKS] = NOBODY;

#define ONE(t) (1 << (t))
#define COUNTS(t) (t + waited[t])

#ifdef STILL_HURRIES
#define HURRIES(t) (hurries[t] && COUNTS(t) < MOST)
#else
#define HURRIES(t) (hurries[t] && COUNTS(t) < MOST && !begun[t])
#endif

#define BEFORE(a, b) \
  (COUNTS(a) > COUNTS(b) || (COUNTS(a) == COUNTS(b) && \
    (HURRIES(a) > HURRIES(b) || (HURRIES(a) == HURRIES(b) && came[a] < came[b]))))

/* ---- a tick ---- */

/* Of those that wait and were not looked at. */
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

#define FORGET(t, w) stood_for[t] = (stood_for[t] == w -> NOBODY : stood_for[t])

inline grant() {
  looked = 0;
  do
  :: true ->
     find_first();
     if
     :: first == NOBODY || seated == SEATS -> break
     :: else
     fi;
     assert(stood_for[first] == NOBODY);
     FORGET(0, first);
     FORGET(1, first);
     FORGET(2, first);
     stage[first] = SITS;
     counted[first] = COUNTS(first);
     begun[first] = true;
     settled[first] = false;
     late[first] = 0;
     seated++
  od;
  assert(seated == SEATS || first == NOBODY)
}

#ifdef ALL_GIVE_WAY
#define FOR_THE_URGENT(w, s) (w == URGENT)
#else
#define FOR_THE_URGENT(w, s) (w == URGENT && COUNTS(w) > counted[s])
#endif

#ifdef LEAST_KEEPS
#define AS_MUCH(w, s) (COUNTS(w) > counted[s])
#else
#define AS_MUCH(w, s) (COUNTS(w) >= counted[s])
#endif

#ifdef NO_TURNS
#define TURN_IS_OVER(w, s) false
#else
#define TURN_IS_OVER(w, s) (AS_MUCH(w, s) && settled[s] && settled[w])
#endif

/* Of those that sit and were not asked: who counts least, and among these who has sat longest. */
inline find_least(w) {
  least = NOBODY;
  t = 0;
  do
  :: t < TASKS ->
     if
     :: stage[t] == SITS && !(asked & ONE(t)) && (FOR_THE_URGENT(w, t) || TURN_IS_OVER(w, t)) &&
        (least == NOBODY || counted[t] < counted[least] || (counted[t] == counted[least] && came[t] < came[least])) ->
        least = t
     :: else
     fi;
     t++
  :: else -> break
  od
}

inline preempt() {
  looked = 0;
  asked = 0;
  do
  :: true ->
     find_first();
     if
     :: first == NOBODY -> break
     :: else
     fi;
     looked = looked | ONE(first);
     find_least(first);
     if
     :: least == NOBODY -> break
     :: else
     fi;
     asked = asked | ONE(least);
     assert(counted[least] < MOST || settled[least]);
     told[least] = true;
     stood_for[least] = first
  od
}

proctype bridge() {
  byte t, first, least, looked, asked;
end:
  do
  :: d_step {
       changed -> changed = false;
       grant();
       preempt();
       t = 0; first = 0; least = 0; looked = 0; asked = 0
     }
  od
}

/* ---- events ---- */

#define MOVE_UP(t) \
  if \
  :: stage[t] != AWAY && came[t] > came[me] -> came[t]-- \
  :: else \
  fi

inline leave_line() {
  MOVE_UP(0);
  MOVE_UP(1);
  MOVE_UP(2)
}

#define THERE (stage[0] != AWAY) + (stage[1] != AWAY) + (stage[2] != AWAY)

inline stand_up() {
  seated--;
  told[me] = false;
  settled[me] = false;
  changed = true
}

proctype task(byte me) {
end:
  do
  :: atomic {
       if
       :: hurries[me] = true
       :: hurries[me] = false
       fi;
       stage[me] = WAITS;
       came[me] = THERE - 1;
       changed = true
     };
     do
     :: d_step {
          stage[me] == SITS ->
          stand_up();
          leave_line();
          stage[me] = AWAY;
          begun[me] = false; hurries[me] = false; waited[me] = 0; came[me] = 0; counted[me] = 0;
          stood_for[me] = NOBODY
        };
        break
     :: d_step {
          stage[me] == SITS && told[me] ->
          stand_up();
          stage[me] = WAITS;
          counted[me] = 0;
#ifndef KEEPS_ITS_PLACE
          leave_line();
          came[me] = THERE - 1
#endif
        }
     od
  od
}

#ifdef SITTERS_AGE
#define AGES(t) (stage[t] != AWAY && COUNTS(t) < MOST)
#else
#define AGES(t) (stage[t] == WAITS && COUNTS(t) < MOST)
#endif

#define AGE(t) \
  waited[t] = waited[t] + AGES(t); \
  settled[t] = (stage[t] != AWAY); \
  late[t] = late[t] + (stage[t] == WAITS); \
  assert(late[t] <= LONGEST)

proctype time() {
end:
  do
  :: d_step {
       !changed && !told[0] && !told[1] && !told[2] ->
       AGE(0);
       AGE(1);
       AGE(2);
       changed = true
     }
  od
}

init { atomic { run bridge(); run task(0); run task(1); run task(2); run time() } }
