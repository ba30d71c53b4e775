/* Border (pons/link/border.hpp), over which a body and its bridges agree when a run begins and ends (pons/runner/processes.cpp,
 * apps/body_command.cpp, apps/bridge_command.cpp). Either may be killed at any step, and another bridge may follow. Nobody reads
 * the run's clock before it is made; a run that begins knows a journal; the path that the body reads is whole; a run that is
 * told to be closed stands so in its journal; and nobody waits for a dead one.
 *
 * A step is an access to shared memory, and so is a look whether the other side lives. The model is sequentially consistent.
 * Who looks again and again does so when something has changed. A person ends the body at some time, and may end one
 * bridge. A path is its bridge's number, in two halves. `closed` is what stands in the journals, by their paths.
 *
 * A run may begin although the bridge that said it was ready is dead: the arm holds until the next one has its parts together.
 *
 * Wrong variants, which the check must reject:
 *   STAGE_FIRST     the run is told to be running before its clock is made
 *   LOOK_TWICE      a bridge that waits looks at the stage for its end, and once more for its beginning
 *   READY_FIRST     a bridge says that it is ready before it has named its journal
 *   ONE_PLACE       a journal's path is written over the one before it
 *   NAMED_FIRST     a path is told before it is whole
 *   NAMED_LATE      a bridge that comes after the end names its journal, too
 *   CLOSING_FIRST   a run is told to be closed before that stands in the journal
 *   BRIDGE_UNSEEN   a body that is asked to end waits for its bridge, dead or alive
 *   BODY_UNSEEN     a bridge looks at the stage, and not whether the body lives */
#define BRIDGES 3
#define KILLS 2

#define WAITING 0
#define RUNNING 1
#define ENDING 2
#define ENDED 3

#define OPEN 0
#define COMPLETE 1
#define BROKEN_OFF 2

#define HALF_MADE 1
#define MADE 2

byte stage = WAITING, clock = 0;
bool ready = false;
byte closing = OPEN;
byte left[2], right[2], named = 0;
bool body_lives = true, bridge_lives = false; /* as the operating system's locks tell */

bool interrupted = false, told_to_leave = false, shot = false, body_shot = false;
bool closed[BRIDGES + 1];
byte closed_by = 0;

proctype person() { interrupted = true }

proctype fate() {
  byte kills = 0;
  bool told = false;
  do
  :: kills < KILLS && !shot -> kills++; shot = true
  :: !told -> told = true; told_to_leave = true
  :: body_shot = true; break
  :: break
  od
}

#ifdef ONE_PLACE
#define PLACE(n) 0
#else
#define PLACE(n) (n % 2)
#endif

#ifdef BODY_UNSEEN
#define BODY_GONE false
#else
#define BODY_GONE (!body_lives)
#endif

#ifdef BRIDGE_UNSEEN
#define IS_LEFT false
#else
#define IS_LEFT (stage == ENDING && !lives)
#endif

proctype body() {
  byte n, l, r;
  bool lives = false, begun = false, complete = false;
  {
    do
    :: interrupted -> break
    :: else ->
       lives = bridge_lives;
       if
       :: lives && ready -> begun = true; break
       :: else
       fi;
       interrupted || bridge_lives != lives || (lives && ready)
    od;
    if
    :: begun ->
#ifdef STAGE_FIRST
       stage = RUNNING;
#endif
       clock = HALF_MADE;
       clock = MADE;
       stage = RUNNING;
       assert(named > 0);
       do
       :: true ->
          lives = bridge_lives;
          if
          :: interrupted && stage == RUNNING -> stage = ENDING
          :: else
          fi;
          if
          :: closing != OPEN || IS_LEFT -> break
          :: else
          fi;
          closing != OPEN || bridge_lives != lives || (interrupted && stage == RUNNING)
       od;
       complete = (closing == COMPLETE)
    :: else
    fi;
    stage = ENDED;
    n = named;
    if
    :: n > 0 ->
       l = left[PLACE(n)];
       r = right[PLACE(n)];
       assert(l == r && l > 0 && l >= closed_by)
    :: else -> assert(!begun)
    fi;
    !bridge_lives; /* it leaves the journal, or is dead */
    assert(!complete || closed[closed_by])
  } unless { body_shot };
  body_lives = false
}

inline name_journal() {
#ifndef NAMED_LATE
  if
  :: stage == ENDED
  :: else ->
#endif
#ifdef NAMED_FIRST
     named = named + 1;
     left[PLACE(named)] = who;
     right[PLACE(named)] = who
#else
     left[PLACE((named + 1))] = who;
     right[PLACE((named + 1))] = who;
     named = named + 1
#endif
#ifndef NAMED_LATE
  fi
#endif
}

inline close_run(how) {
#ifdef CLOSING_FIRST
  atomic { closing = how; closed_by = who };
  closed[who] = true
#else
  closed[who] = true;
  atomic { closing = how; closed_by = who }
#endif
}

proctype bridges() {
  byte who = 0, seen;
  do
  :: who < BRIDGES && body_lives ->
     who++;
     bridge_lives = true;
     {
#ifdef READY_FIRST
       ready = true;
       name_journal();
#else
       name_journal();
       ready = true;
#endif
       do
       :: true ->
          seen = stage;
          if
          :: seen == ENDED || BODY_GONE || told_to_leave -> goto leaves
          :: else
          fi;
#ifdef LOOK_TWICE
          seen = stage;
#endif
          if
          :: seen != WAITING -> break
          :: else
          fi;
          stage != seen || BODY_GONE || told_to_leave
       od;
       do
       :: true ->
          seen = stage;
          assert(clock == MADE);
          if
          :: seen == ENDED || BODY_GONE || told_to_leave -> goto leaves
          :: seen == ENDING -> close_run(BROKEN_OFF); goto leaves
          :: seen == RUNNING && body_lives -> close_run(COMPLETE); goto leaves
          :: seen == RUNNING -> stage != seen || BODY_GONE || told_to_leave
          fi
       od;
leaves:
       told_to_leave = false
     } unless { shot };
     shot = false;
     bridge_lives = false
  :: else -> break
  od
}

init { atomic { run person(); run fate(); run body(); run bridges() } }
