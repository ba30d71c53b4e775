#include "pons/world/faults.hpp"
