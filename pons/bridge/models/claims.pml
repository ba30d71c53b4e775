/* Arbiter (pons/bridge/schedule/arbiter.hpp), and how the bridge preempts and pauses (pons/bridge/verbs.cpp). No resource
 * is in use by two tasks. No circle of waiting closes: tasks end. And nobody starves: once a task has waited so long that
 * it counts most, others are granted what it needs at most OVERTAKEN times before it has ended, however many keep coming.
 * Who makes way counts less than the one that it makes way for, so that it is not the next again.
 *
 * Three tasks, each of which comes again as often as it likes. Task t counts t, and needs resource t, the next one round,
 * or both; with a deadline or without. The last one is urgent. A run ends at any time. A person pauses any that runs,
 * and resumes it at any time; in between it does not end. One that waits, paused, is out of the queue until it is
 * resumed. A step is an event, or the part of a tick that grants and preempts: the bridge is one thread. Several events
 * may come before a tick.
 *
 * Time is counted in periods of ageing, and only up to where it makes no more difference. All deadlines are the same,
 * and none is missed. `uses` (what a task has its hands on) and `overtaken` are the model's own memory.
 *
 * Wrong variants, which the check must reject:
 *   ONE_BY_ONE        a task takes what it may have of its resources, and holds that while it waits for the rest
 *   LATER_ONES_PASS   a waiting task does not keep later ones off what it needs: who needs two never finds both free
 *   NO_AGEING         a task counts the same for ever: more important ones keep coming
 *   DEADLINES_FIRST   deadlines order those too that count most: ones with a deadline keep coming
 *   ALL_GIVE_WAY      those too give way to an urgent task that count as much by now: one that begins never ends
 *   HAND_OVER_FIRST   a preempted task's resources are given away when it is told to stop, not when it stands
 *   RUNNERS_AGE       who runs grows older, too: one that has run for long is granted again before the urgent one */
#define TASKS 3
#define NOBODY TASKS
#define URGENT 2
#define MOST 3 /* above what any task counts by itself */
#define OVERTAKEN 2

#define AWAY 0
#define WAITS 1
#define RUNS 2
#define PARKED 3

#define NOTHING 0
#define PAUSE 1
#define PREEMPT 2

#define ONE(t) (1 << (t))
#define OTHER(t) (1 << ((t + 1) % TASKS))

byte stage[TASKS], told[TASKS], needs[TASKS];
bool hurries[TASKS];
byte waited[TASKS];  /* so many periods */
byte came[TASKS];    /* after so many of those that are there */
byte counted[TASKS]; /* so much when it was granted */
byte held = 0;       /* by all who run */
bool changed = false;

byte uses[TASKS], overtaken[TASKS];
#ifdef ONE_BY_ONE
byte got[TASKS];
#endif

#ifdef NO_AGEING
#define COUNTS(t) (t)
#else
#define COUNTS(t) (t + waited[t])
#endif

#ifdef DEADLINES_FIRST
#define HURRIES(t) (hurries[t])
#else
#define HURRIES(t) (hurries[t] && COUNTS(t) < MOST)
#endif

#ifdef RUNNERS_AGE
#define AGING(t) (stage[t] != AWAY)
#else
#define AGING(t) (stage[t] == WAITS)
#endif

#define WAITED_LONG(t) (t + waited[t] == MOST)
#define SHARE(a, b) ((needs[a] & needs[b]) != 0)
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

inline start(who) {
  stage[who] = RUNS;
  counted[who] = COUNTS(who);
#ifdef ONE_BY_ONE
  got[who] = 0;
#endif
  uses[who] = needs[who];
  t = 0;
  do
  :: t < TASKS ->
     assert(t == who || !(uses[t] & needs[who]));
     if
     :: stage[t] == WAITS && SHARE(t, who) && WAITED_LONG(t) ->
        overtaken[t]++;
        assert(overtaken[t] <= OVERTAKEN)
     :: else
     fi;
     t++
  :: else -> break
  od
}

#ifdef ONE_BY_ONE
#define TAKE(r) \
  if \
  :: (needs[first] & r) && !(taken & r) -> got[first] = got[first] | r; held = held | r \
  :: else \
  fi
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
#ifdef ONE_BY_ONE
     TAKE(ONE(first));
     TAKE(OTHER(first));
     free = (got[first] == needs[first]);
#else
     free = !(needs[first] & taken);
#endif
#ifdef LATER_ONES_PASS
     taken = taken | (free -> needs[first] : 0);
#else
     taken = taken | needs[first];
#endif
     if
     :: free -> held = held | needs[first]; start(first)
     :: else
     fi
  od
}

inline wait_again(who) {
  held = held & ~needs[who];
  counted[who] = 0;
  stage[who] = WAITS;
  assert(COUNTS(who) < COUNTS(URGENT));
  changed = true
}

/* It would get what the urgent one needs. */
#define IN_FRONT(t) (stage[t] == WAITS && SHARE(t, URGENT) && BEFORE(t, URGENT))
#define IN_THE_WAY(t) (stage[t] == RUNS && SHARE(t, URGENT))
#ifdef ALL_GIVE_WAY
#define GIVES_WAY(t) true
#else
#define GIVES_WAY(t) (!IN_THE_WAY(t) || counted[t] < COUNTS(URGENT))
#endif

inline tell(who) {
  if
  :: IN_THE_WAY(who) && told[who] == NOTHING ->
     told[who] = PREEMPT;
#ifdef HAND_OVER_FIRST
     wait_again(who)
#endif
  :: else
  fi
}

inline preempt() {
  if
  :: stage[URGENT] == WAITS && !IN_FRONT(0) && !IN_FRONT(1) && GIVES_WAY(0) && GIVES_WAY(1) -> tell(0); tell(1)
  :: else
  fi
}

proctype bridge() {
  byte t, first, taken, looked;
  bool free;
end:
  do
  :: d_step {
       changed -> changed = false;
       grant();
       preempt();
       t = 0; first = 0; taken = 0; looked = 0; free = false
     }
  od
}

/* ---- events ---- */

inline come() {
  stage[me] = WAITS;
  came[me] = (stage[0] != AWAY) + (stage[1] != AWAY) + (stage[2] != AWAY) - 1;
  changed = true
}

#define MOVE_UP(t) \
  if \
  :: stage[t] != AWAY && came[t] > came[me] -> came[t]-- \
  :: else \
  fi

inline leave() {
  held = held & ~needs[me];
  MOVE_UP(0);
  MOVE_UP(1);
  MOVE_UP(2);
  stage[me] = AWAY;
  told[me] = NOTHING;
  uses[me] = 0; needs[me] = 0; hurries[me] = false;
  waited[me] = 0; came[me] = 0; counted[me] = 0; overtaken[me] = 0;
  changed = true
}

proctype task(byte me) {
  do
  :: atomic {
       if
       :: needs[me] = ONE(me)
       :: needs[me] = OTHER(me)
       :: needs[me] = ONE(me) | OTHER(me)
       fi;
       if
       :: hurries[me] = true
       :: true
       fi;
       come()
     };
     do
     :: atomic { stage[me] == RUNS && told[me] != PAUSE -> leave(); break }
     :: d_step {
          told[me] == PREEMPT -> told[me] = NOTHING; /* it stands */
          uses[me] = 0;
#ifndef HAND_OVER_FIRST
          wait_again(me)
#endif
        }
     od
  :: break
  od
}

/* Also one that was told to hand over: that is forgotten, and it may be told again. */
#define PAUSES(t) d_step { stage[t] == RUNS && told[t] != PAUSE -> told[t] = PAUSE }
#define RESUMES(t) d_step { told[t] == PAUSE -> told[t] = NOTHING; changed = true }
/* One that waits leaves the queue: whom it let by has not overtaken it. */
#define PARKS(t) d_step { stage[t] == WAITS -> stage[t] = PARKED; overtaken[t] = 0; changed = true }
#define COMES_BACK(t) d_step { stage[t] == PARKED -> stage[t] = WAITS; changed = true }

proctype person() {
end:
  do
  :: PAUSES(0)
  :: PAUSES(1)
  :: PAUSES(2)
  :: RESUMES(0)
  :: RESUMES(1)
  :: RESUMES(2)
  :: PARKS(0)
  :: PARKS(1)
  :: PARKS(2)
  :: COMES_BACK(0)
  :: COMES_BACK(1)
  :: COMES_BACK(2)
  od
}

#define AGES(t) (AGING(t) && !WAITED_LONG(t))
#define AGE(t) waited[t] = waited[t] + AGES(t)

proctype time() {
end:
  do
  :: d_step { AGES(0) || AGES(1) || AGES(2) -> AGE(0); AGE(1); AGE(2); changed = true }
  od
}

init { atomic { run bridge(); run task(0); run task(1); run task(2); run person(); run time() } }
