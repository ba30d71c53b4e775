# The face for people. Everything below is a line or two of CMake that you can also run yourself.
.DEFAULT_GOAL := help
JOBS ?= $(shell nproc)
# One more than there are CPUs: many tests wait for a clock or for another process.
TEST_JOBS ?= $(shell expr $$(nproc) + 1)
WORLD ?= parcel_cell
PARCELS ?= 200
SEED ?= 1
SOURCES = git ls-files --cached --others --exclude-standard -- '*.cpp' '*.hpp'
# What reads bytes from outside or handles memory by hand; the rest runs under the sanitizers with make asan.
ASAN_QUICK = record_test task_test world_test link_test gate_test bridge_test
# What threads share without locks.
TSAN_QUICK = rt_test link_test
# What runs inside a tick, and what is exercised with it.
LOOP = rt_test link_test motion_test cerebellum_test
# What reads bytes that others wrote: fuzz/NAME.cpp.
FUZZERS = cdr foxglove journal mcap ros task tree
FUZZ_S ?= 30
# Interfaces that real nodes need beside those of ROS 2's wheels.
ROS_MESSAGES = ros2/pons_msgs $(wildcard ros2/dialects/*) $(addprefix ros2/interfaces/,control_msgs nav2_msgs tf2_msgs)

.PHONY: help setup build demo test check format format-check asan asan-quick tsan tsan-quick rtsan fuzz gates bench bench-peers ros-peers clean

help: ## what there is
	@echo "Pons: the bridge between a robot's brain and its body."
	@echo
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)
	@echo
	@echo "  JOBS=$(JOBS) WORLD=$(WORLD) PARCELS=$(PARCELS) SEED=$(SEED): set them as in make demo SEED=7"

setup: ## install what is needed (Debian packages, wheels in .venv)
	@tools/setup

build: setup ## set up and build everything into build/release
	cmake --preset release
	cmake --build --preset release --parallel $(JOBS)

demo: setup ## set up, build, and sort 200 parcels; report and picture land in build/
	cmake --preset release
	cmake --build --preset release --parallel $(JOBS) --target pons
	build/release/apps/pons run $(WORLD) --parcels $(PARCELS) --seed $(SEED) --lockstep \
	  --report build/demo.json --picture build/demo.png

test: build ## set up, build, and run all tests
	ctest --preset release --parallel $(TEST_JOBS) --no-tests=error

check: format-check ## format, clang-tidy, layers, style, then all tests
	cmake --preset release
	tools/check_layers
	tools/check_style
	cmake --build --preset release --parallel $(JOBS)
	tools/tidy build/release
	ctest --preset release --parallel $(TEST_JOBS) --no-tests=error

format-check: ## say which sources are not as .clang-format says
	@tools/setup --check
	$(SOURCES) | xargs clang-format-19 --dry-run -Werror

format: ## rewrite the sources as .clang-format says
	@tools/setup --check
	$(SOURCES) | xargs clang-format-19 -i

# Fast DDS deletes objects of its own by another size than they were made with.
asan asan-quick: export ASAN_OPTIONS = new_delete_type_mismatch=0
asan: setup ## all tests under the address and undefined-behaviour sanitizers
	cmake --preset asan
	cmake --build --preset asan --parallel $(JOBS)
	ctest --preset asan --parallel 2 --no-tests=error

asan-quick: setup ## the tests of what reads bytes from outside, under the same sanitizers
	cmake --preset asan
	cmake --build --preset asan --parallel $(JOBS) --target $(ASAN_QUICK)
	for name in $(ASAN_QUICK); do build/asan/pons/$${name%_test}/$$name --gtest_brief=1 || exit 1; done

tsan: setup ## all tests under the thread sanitizer
	cmake --preset tsan
	cmake --build --preset tsan --parallel $(JOBS)
	ctest --preset tsan --parallel 2 --no-tests=error

tsan-quick: setup ## the tests of what threads share without locks, under the same sanitizer
	cmake --preset tsan
	cmake --build --preset tsan --parallel $(JOBS) --target $(TSAN_QUICK) relaxed_releases recording_threads_test
	for name in $(TSAN_QUICK); do \
	  TSAN_OPTIONS=suppressions=$(CURDIR)/tools/tsan_suppressions.txt build/tsan/pons/$${name%_test}/$$name --gtest_brief=1 || exit 1; \
	done
	ctest --preset tsan -R 'relaxed_release|RecordingThreads' --no-tests=error

rtsan: export RTSAN_OPTIONS = external_symbolizer_path=/usr/bin/addr2line
rtsan: ## the control loop's tests under RealtimeSanitizer, and that it fires
	@tools/setup --check
	cmake --preset rtsan
	cmake --build --preset rtsan --parallel $(JOBS) --target $(LOOP) known_bad_test
	for name in $(LOOP); do build/rtsan/pons/$${name%_test}/$$name --gtest_brief=1 || exit 1; done
	ctest --preset rtsan -R 'KnownBad|KnownGood|blocking_call' --no-tests=error

fuzz: ## every fuzzer for FUZZ_S seconds
	@tools/setup --check
	cmake --preset fuzz
	cmake --build --preset fuzz --parallel $(JOBS) --target $(addprefix fuzz_,$(FUZZERS))
	mkdir -p $(addprefix build/fuzz/corpus/,$(FUZZERS))
	printf '%s\n' $(FUZZERS) | xargs -P $(JOBS) -I NAME sh -c 'exec build/fuzz/fuzz/fuzz_NAME -max_total_time=$(FUZZ_S) \
	  -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 -artifact_prefix=build/fuzz/NAME- build/fuzz/corpus/NAME fuzz/corpus/NAME'

# Outside CMake: a peer is compiled from Debian's Eigen, of which nothing may enter our build.
bench-peers: ## build what the benchmarks compare against
	@tools/setup --bench
	mkdir -p build/release/bench/peers
	g++ -std=c++17 -O3 -DNDEBUG -Wall -Wextra -Werror -isystem /usr/include/eigen3 bench/peers/kdl_inverse.cpp \
	  -lorocos-kdl -o build/release/bench/peers/kdl_inverse

ros-peers: .venv-ros/messages ## runs beside real nodes of ROS 2, as wheels (260 MB; wants a python3.12)
	cmake --preset release
	cmake --build --preset release --parallel $(JOBS) --target pons
	for name in arm dialects pictures rounds; do .venv-ros/bin/python tests/ros/real/$${name}_test.py build/release/apps/pons || exit 1; done

.venv-ros/messages: tools/requirements-ros.txt tests/ros/real/messages.py $(shell find $(ROS_MESSAGES) -type f)
	@tools/setup --ros
	.venv-ros/bin/python tests/ros/real/messages.py $(ROS_MESSAGES) >/dev/null
	touch $@

gates: build bench-peers ## the benchmarks with bars, which fail where one is missed; on a computer that does nothing else
	for program in cdr control_step inverse_kinematics journal recording ros_images ros_round_trip scheduling stop_latency trees wake_up; do build/release/bench/$$program --gate || exit 1; done
	build/release/bench/trajectory_generation --gate --cases 1000000 --rounds 10
	bench/ros_flood.py --gate --burner

bench: build bench-peers ## run the benchmarks; docs/figures.md says which figure is whose
	@programs=$$(find build/release/bench -maxdepth 1 -type f -executable | sort); \
	  [ -n "$$programs" ] || { echo "bench: build/release/bench holds no benchmark"; exit 1; }; \
	  for program in $$programs bench/ros_flood.py; do echo "== $$program"; "$$program" || exit 1; done

clean: ## remove what was built (keeps .venv)
	rm -rf build install log
