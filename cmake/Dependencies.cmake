# Everything from outside, found once. Boost, Eigen, tinyxml2, Pinocchio and MuJoCo come from the wheels in .venv; nothing
# may pull Debian's Boost or Eigen into the process beside them (tests/one_boost_one_eigen_test.cpp reads the maps).
set(PONS_WHEELS "${PROJECT_SOURCE_DIR}/.venv/lib/python3.11/site-packages" CACHE PATH "Where tools/setup put the wheels")
set(PONS_PREFIX "${PONS_WHEELS}/cmeel.prefix")
if(NOT EXISTS "${PONS_PREFIX}")
  message(FATAL_ERROR "No wheels in ${PONS_WHEELS}. Run tools/setup first (make demo and make test do).")
endif()

find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)

add_library(pons_eigen INTERFACE)
target_include_directories(pons_eigen SYSTEM INTERFACE "${PONS_PREFIX}/include/eigen3")
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  # Under a sanitizer Eigen chooses another allocator than the wheels were built with, and each frees the other's memory.
  target_compile_definitions(pons_eigen INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
add_library(ext::eigen ALIAS pons_eigen)

# Headers alone.
add_library(pons_boost INTERFACE)
target_include_directories(pons_boost SYSTEM INTERFACE "${PONS_PREFIX}/include")
add_library(ext::boost ALIAS pons_boost)

function(pons_wheel_library name file)
  add_library(pons_ext_${name} SHARED IMPORTED GLOBAL)
  set_target_properties(pons_ext_${name} PROPERTIES IMPORTED_LOCATION "${file}")
  if(NOT EXISTS "${file}")
    message(FATAL_ERROR "${file} is missing. Run tools/setup again after deleting .venv.")
  endif()
  add_library(ext::${name} ALIAS pons_ext_${name})
endfunction()

set(lib "${PONS_PREFIX}/lib")
foreach(name pinocchio_default pinocchio_parsers pinocchio_collision coal urdfdom_model console_bridge tinyxml2)
  pons_wheel_library(${name} "${lib}/lib${name}.so")
endforeach()
target_include_directories(pons_ext_pinocchio_default SYSTEM INTERFACE "${PONS_PREFIX}/include"
  "${PONS_PREFIX}/include/urdfdom_headers")
target_compile_definitions(pons_ext_pinocchio_default INTERFACE
  BOOST_MPL_LIMIT_LIST_SIZE=30 BOOST_MPL_LIMIT_VECTOR_SIZE=30 BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
  BOOST_FUSION_INVOKE_MAX_ARITY=12 PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION PINOCCHIO_WITH_COLLISION
  PINOCCHIO_WITH_URDFDOM PINOCCHIO_URDFDOM_HEADERS_MAJOR_VERSION=3 PINOCCHIO_URDFDOM_HEADERS_MINOR_VERSION=0
  PINOCCHIO_URDFDOM_HEADERS_PATCH_VERSION=0)
target_link_libraries(pons_ext_pinocchio_default INTERFACE ext::eigen)
add_library(pons_pinocchio INTERFACE)
target_link_libraries(pons_pinocchio INTERFACE ext::pinocchio_default ext::pinocchio_parsers ext::pinocchio_collision ext::coal
  ext::urdfdom_model ext::console_bridge ext::eigen)
target_link_options(pons_pinocchio INTERFACE "-Wl,-rpath-link,${lib}")
add_library(ext::pinocchio ALIAS pons_pinocchio)
target_include_directories(pons_ext_tinyxml2 SYSTEM INTERFACE "${PONS_PREFIX}/include")

pons_wheel_library(mujoco "${PONS_WHEELS}/mujoco/libmujoco.so.3.17.0")
target_include_directories(pons_ext_mujoco SYSTEM INTERFACE "${PONS_WHEELS}/mujoco/include")

pkg_check_modules(zxing REQUIRED IMPORTED_TARGET GLOBAL zxing)
add_library(ext::zxing ALIAS PkgConfig::zxing)
pkg_check_modules(sqlite REQUIRED IMPORTED_TARGET GLOBAL sqlite3)
add_library(ext::sqlite ALIAS PkgConfig::sqlite)
pkg_check_modules(postgres REQUIRED IMPORTED_TARGET GLOBAL libpq)
add_library(ext::postgres ALIAS PkgConfig::postgres)
pkg_check_modules(turbojpeg REQUIRED IMPORTED_TARGET GLOBAL libturbojpeg)
add_library(ext::turbojpeg ALIAS PkgConfig::turbojpeg)
foreach(name deflate lz4 zstd)
  pkg_check_modules(${name} REQUIRED IMPORTED_TARGET GLOBAL lib${name})
  add_library(ext::${name} ALIAS PkgConfig::${name})
endforeach()

find_library(PONS_QRCODEGEN qrcodegencpp REQUIRED)
add_library(pons_qrcodegen INTERFACE)
target_link_libraries(pons_qrcodegen INTERFACE "${PONS_QRCODEGEN}")
add_library(ext::qrcodegen ALIAS pons_qrcodegen)

# Only the three OpenCV libraries that we use: the full package brings Debian's Boost through its other parts.
add_library(pons_opencv INTERFACE)
target_include_directories(pons_opencv SYSTEM INTERFACE /usr/include/opencv4)
target_link_libraries(pons_opencv INTERFACE opencv_core opencv_imgproc)
add_library(ext::opencv ALIAS pons_opencv)
find_package(yaml-cpp REQUIRED)
add_library(ext::yaml ALIAS yaml-cpp)
find_package(nlohmann_json REQUIRED)
add_library(ext::json ALIAS nlohmann_json::nlohmann_json)
find_package(fmt REQUIRED)
add_library(ext::fmt ALIAS fmt::fmt)
find_package(CLI11 REQUIRED)
add_library(ext::cli11 ALIAS CLI11::CLI11)

# Not by its own CMake files: they would link Debian's tinyxml2, too (docs/decisions/0045).
find_library(PONS_FASTDDS fastrtps REQUIRED)
find_library(PONS_FASTCDR fastcdr REQUIRED)
add_library(pons_fastcdr INTERFACE)
target_link_libraries(pons_fastcdr INTERFACE "${PONS_FASTCDR}")
add_library(ext::fastcdr ALIAS pons_fastcdr)
add_library(pons_fastdds INTERFACE)
target_include_directories(pons_fastdds SYSTEM INTERFACE /usr/include/foonathan_memory
  /usr/include/${CMAKE_LIBRARY_ARCHITECTURE}/foonathan_memory)
target_link_libraries(pons_fastdds INTERFACE "${PONS_FASTDDS}")
add_library(ext::fastdds ALIAS pons_fastdds)

add_library(pons_egl INTERFACE)
target_link_libraries(pons_egl INTERFACE EGL)
add_library(ext::egl ALIAS pons_egl)
