/* MonotonicClock on a leash (pons/rt/clock.hpp): what one reader gets from now() never goes back, and it is never beyond the
 * bound, whatever the pacer does meanwhile.
 *
 * A step is an access to shared memory or to the computer's clock, which may advance at any time. The model is
 * sequentially consistent; what release and acquire forbid is modelled by the variants that swap two steps.
 *
 * Wrong variants, which the check must reject:
 *   BOUND_FIRST   reach() lets the bound go before it has noted how long time stood still (relaxed stores)
 *   RUNNING_FIRST now() reads the running time before the bound
 *   STILL_LAST    now() reads the computer's clock before what it must take off it */
#define LEASH 1
#define END 5

byte raw = 0;
byte bound = LEASH, still = 0;

proctype computer() {
  do
  :: raw < END -> raw++
  :: else -> break
  od
}

#ifdef STILL_LAST
#define READ_RUNNING(r) r = raw; r = r - still
#else
#define READ_RUNNING(r) r = still; r = raw - r
#endif

#ifdef RUNNING_FIRST
#define READ_NOW(n, r, b) READ_RUNNING(r); b = bound; n = (r < b -> r : b)
#else
#define READ_NOW(n, r, b) b = bound; READ_RUNNING(r); n = (r < b -> r : b)
#endif

proctype pacer() {
  short running, beyond, time, r, b;
  byte reached = 0;
  do
  :: reached < END - 1 && raw < END ->
     READ_NOW(time, r, b);
     if
     :: time > reached ->
        READ_RUNNING(running);
        beyond = running - bound;
#ifdef BOUND_FIRST
        bound = time + LEASH;
#endif
        if
        :: beyond > 0 -> still = still + beyond
        :: else
        fi;
#ifndef BOUND_FIRST
        bound = time + LEASH;
#endif
        reached = time
     :: else
     fi
  :: else -> break
  od
}

proctype reader() {
  short now, r, b, last = 0;
  byte reads = 0;
  do
  :: reads < 4 ->
     READ_NOW(now, r, b);
     assert(now >= last);
     assert(now <= bound);
     last = now;
     reads++
  :: else -> break
  od
}

init { atomic { run computer(); run pacer(); run reader() } }
