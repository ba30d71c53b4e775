/* WakeWord and the loop that sleeps on it (pons/rt/wake_word.cpp, periodic_loop.cpp): after each change of the word a tick
 * looks at the new value without waiting for its deadline. Deadlines never come here, so a lost wake-up is a deadlock.
 *
 * The kernel's part is as futex(2) promises: comparing the word and falling asleep is one step.
 *
 * Wrong variants, which the check must reject:
 *   NO_COMPARE       falls asleep without comparing once more
 *   WAKE_FIRST       wakes before the word is changed
 *   SEEN_AFTER_LOOK  the loop notes the word after the tick has looked at it, and sleeps on what no tick has seen */
#define CHANGES 3

byte word = 0;
bool asleep = false;
byte looked = 0; /* the value that the last tick saw */

proctype raiser() {
  byte i = 1;
  do
  :: i <= CHANGES ->
#ifdef WAKE_FIRST
     asleep = false;
     word = i;
#else
     word = i;
     asleep = false;
#endif
     i++
  :: else -> break
  od
}

proctype loop() {
  byte seen = 0;
  do
  :: looked < CHANGES ->
     /* wait(seen) */
     do
     :: word != seen -> break
     :: word == seen ->
#ifdef NO_COMPARE
        asleep = true;
#else
        atomic {
          if
          :: word == seen -> asleep = true
          :: else
          fi
        };
#endif
        !asleep
     od;
     /* the tick */
#ifdef SEEN_AFTER_LOOK
     looked = word;
     seen = word
#else
     seen = word;
     looked = word
#endif
  :: else -> break
  od
}

init { atomic { run raiser(); run loop() } }
