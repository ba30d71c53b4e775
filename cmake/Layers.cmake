# Who may include whom, directly. docs/architecture.md explains the table; tools/check_layers holds the sources to it.
# A module that is not listed does not exist; a dependency that is not listed is refused at configure time.
set(PONS_MAY_USE_core "")
set(PONS_MAY_USE_rt core)
set(PONS_MAY_USE_world core)
set(PONS_MAY_USE_model world core)
set(PONS_MAY_USE_motion model core)
set(PONS_MAY_USE_link rt core)
set(PONS_MAY_USE_body core)
set(PONS_MAY_USE_sim body world core)
set(PONS_MAY_USE_cerebellum link motion model body rt core)
set(PONS_MAY_USE_task core)
set(PONS_MAY_USE_bridge task link world core)
set(PONS_MAY_USE_perception model world core)
set(PONS_MAY_USE_skills task link motion model perception world core)
set(PONS_MAY_USE_brain task world core)
set(PONS_MAY_USE_wire core)
set(PONS_MAY_USE_record wire task link core)
set(PONS_MAY_USE_gate wire task link model world rt core)
set(PONS_MAY_USE_runner bridge cerebellum perception brain record body
    task link world motion model rt wire core)
set(PONS_MAY_USE_referee sim bridge core)
# Of a module it may use, the only headers (by prefix) that a module may include; tools/check_layers enforces it.
set(PONS_ONLY_referee pons/sim/truth.hpp pons/bridge/journal/)
