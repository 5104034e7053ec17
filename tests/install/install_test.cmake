# Installs a build into an empty prefix, builds the example against that alone, and compares what
# the example draws with what the installed program draws.
#
#   cmake -D BUILD=DIR -D EXAMPLE=DIR -D WORK=DIR -D CXX=COMPILER -D SANITIZE=NAMES
#     -P install_test.cmake

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGV " " line)
    message(FATAL_ERROR "${line}\nended with ${result}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# A prefix with a space, which careless quoting would break.
set(prefix "${WORK}/a prefix")
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})

# No installed text file may lead back to the tree it was built from.
file(GLOB_RECURSE texts ${prefix}/*.cmake ${prefix}/*.h)
list(LENGTH texts count)
if(count LESS 10)
  message(FATAL_ERROR "${prefix} holds ${count} headers and CMake files, expected at least 10")
endif()
foreach(file ${texts})
  file(READ ${file} text)
  string(FIND "${text}" "${BUILD}" found)
  if(NOT found EQUAL -1)
    message(FATAL_ERROR "${file} names the build folder ${BUILD}")
  endif()
endforeach()

if(SANITIZE)
  set(flags -DCMAKE_CXX_FLAGS=-fsanitize=${SANITIZE})
endif()
run(${CMAKE_COMMAND} -S ${EXAMPLE} -B ${WORK}/example -G Ninja -DCMAKE_BUILD_TYPE=Release ${flags}
  -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_PREFIX_PATH=${prefix}
  -DCMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON)
run(${CMAKE_COMMAND} --build ${WORK}/example)
file(STRINGS ${WORK}/example/CMakeCache.txt found_in REGEX "^haarlight_DIR:")
if(NOT found_in MATCHES "a prefix")
  message(FATAL_ERROR "the example found ${found_in}, expected it in ${prefix}")
endif()

# A small transport and light, made by the installed programs.
set(haarlight ${prefix}/bin/haarlight)
run(${prefix}/bin/haarlight-data scene spheres -o ${WORK}/spheres.glb)
run(${prefix}/bin/haarlight-data environment gallery --size 256 -o ${WORK}/gallery.exr)
run(${haarlight} precompute ${WORK}/spheres.glb -o ${WORK}/spheres.hlt --size 48x48 --face 16)

# Both draw frame 29 of the same motion by the same method: the same picture.
run(${WORK}/example/relight_minimal ${WORK}/spheres.hlt ${WORK}/gallery.exr ${WORK}/example.exr)
run(${haarlight} relight ${WORK}/spheres.hlt --env ${WORK}/gallery.exr -o ${WORK}/program
  --motion rotate --degrees 90 --stop 19 --frames 30 --method pbi --wavelets 30 --weight area
  --save-frames 29 --formats exr --no-background)
run(${haarlight} compare ${WORK}/example.exr ${WORK}/program/frame_0029.exr --json)
string(JSON difference GET "${output}" max_abs)
if(NOT difference EQUAL 0)
  message(FATAL_ERROR "example and program differ by ${difference}, expected the same picture")
endif()

# A black picture would agree as well: there must be light on the scene.
run(${haarlight} relight ${WORK}/spheres.hlt --env ${WORK}/gallery.exr -o ${WORK}/first
  --motion still --frames 1 --formats exr --no-background)
run(${haarlight} compare ${WORK}/example.exr ${WORK}/first/frame_0000.exr --json)
string(JSON difference GET "${output}" relative_rmse)
if(difference LESS 0.01)
  message(FATAL_ERROR "turning the light changed the picture by ${difference}, expected over 0.01")
endif()
message(STATUS "example and program agree; turning the light changed the picture by ${difference}")
