if(PONS_BUILD_TESTS)
  include(GoogleTest)
endif()

add_library(pons_flags INTERFACE)
target_compile_features(pons_flags INTERFACE cxx_std_23)
# -ffp-contract=off: the same seed gives the same bytes whatever the compiler fuses.
target_compile_options(pons_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
  -Wno-missing-field-initializers -Wnon-virtual-dtor -Woverloaded-virtual -Werror -ffp-contract=off
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<NOT:$<CONFIG:Debug>>>:-Wno-maybe-uninitialized>)
target_include_directories(pons_flags INTERFACE "${PROJECT_SOURCE_DIR}")
# What PONS_NONBLOCKING promises, clang checks where it compiles. Eigen's and Pinocchio's templates promise nothing, so of
# the modules that compute with them only the run-time checks judge.
set(PONS_EFFECTS "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 20)
  set(PONS_EFFECTS -Wfunction-effects)
endif()
set(PONS_EFFECTS_UNKNOWN_IN model cerebellum)

# pons_module(NAME [SOURCES ...] [TESTS ...] [USES modules ...] [LIBRARIES external targets ...] [TEST_LIBRARIES ...])
#
# Declares the folder it is called in as module NAME: a static library pons::NAME (an interface one without SOURCES) and,
# with TESTS, one test program. USES may only name modules that cmake/Layers.cmake allows.
function(pons_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;TESTS;USES;LIBRARIES;TEST_LIBRARIES" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "pons_module(${name}): unknown arguments ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT DEFINED PONS_MAY_USE_${name})
    message(FATAL_ERROR "pons_module(${name}): not in cmake/Layers.cmake; add it there and to docs/architecture.md")
  endif()
  foreach(used IN LISTS ARG_USES)
    if(NOT used IN_LIST PONS_MAY_USE_${name})
      message(FATAL_ERROR "pons/${name} may not use pons/${used}: cmake/Layers.cmake allows '${PONS_MAY_USE_${name}}'")
    endif()
  endforeach()
  list(TRANSFORM ARG_USES PREPEND "pons::" OUTPUT_VARIABLE uses)

  if(ARG_SOURCES)
    add_library(pons_${name} STATIC ${ARG_SOURCES})
    target_link_libraries(pons_${name} PUBLIC pons_flags ${uses} ${ARG_LIBRARIES})
    if(NOT name IN_LIST PONS_EFFECTS_UNKNOWN_IN)
      target_compile_options(pons_${name} PRIVATE ${PONS_EFFECTS})
    endif()
  else()
    add_library(pons_${name} INTERFACE)
    target_link_libraries(pons_${name} INTERFACE pons_flags ${uses} ${ARG_LIBRARIES})
  endif()
  add_library(pons::${name} ALIAS pons_${name})
  set_property(GLOBAL APPEND PROPERTY PONS_MODULES ${name})

  if(ARG_TESTS)
    pons_test(${name}_test SOURCES ${ARG_TESTS} LIBRARIES pons::${name} ${ARG_TEST_LIBRARIES})
  endif()
endfunction()

# pons_test(NAME SOURCES ... LIBRARIES ... [LABELS ...] [TIMEOUT s] [BY_THE_CLOCK]): one GoogleTest program, its cases known
# to ctest. BY_THE_CLOCK: its runs are in real time, so each of its cases counts as two, and none runs beside another such
# one: of two CPUs it has one for itself. They begin first, for they last long together, and all others run beside them.
# Without PONS_BUILD_TESTS it does nothing.
function(pons_test name)
  if(NOT PONS_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "BY_THE_CLOCK" "TIMEOUT" "SOURCES;LIBRARIES;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE pons_flags ${ARG_LIBRARIES} GTest::gmock GTest::gtest_main)
  # A quarter of compiling a test is optimising it; what it tests is as optimised as ever.
  target_compile_options(${name} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O1>)
  set(clock "")
  if(ARG_BY_THE_CLOCK)
    set(clock PROCESSORS 2 RESOURCE_LOCK clock COST 100)
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}" ${clock})
endfunction()
