# Hard cases: one binary a group of rows, so that a planted fault (planted.py) relinks one of them.
# Each test leaves a report in HARD_CASES_FOLDER, from which stability_table.py makes a table.
set(HARD_CASES_FOLDER ${CMAKE_BINARY_DIR}/hard_cases)

# haarlight_hard_test(GROUP SOURCES... USES ...): binary test_hard_GROUP of tests/hard/SOURCES.cpp.
function(haarlight_hard_test group)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES" ${ARGN})
  list(TRANSFORM ARG_SOURCES PREPEND hard/)
  list(TRANSFORM ARG_SOURCES APPEND .cpp)
  add_executable(test_hard_${group} ${ARG_SOURCES})
  target_link_libraries(test_hard_${group} PRIVATE ${ARG_USES} haarlight_flags fmt::fmt
    GTest::gtest_main)
  target_include_directories(test_hard_${group} PRIVATE ${PROJECT_SOURCE_DIR})
  gtest_discover_tests(test_hard_${group} DISCOVERY_TIMEOUT 60 XML_OUTPUT_DIR ${HARD_CASES_FOLDER}
    PROPERTIES LABELS hard TIMEOUT ${HAARLIGHT_TEST_TIMEOUT} FIXTURES_SETUP hard_cases
    ENVIRONMENT ${HAARLIGHT_TEST_ENVIRONMENT})
endfunction()

find_package(rapidcheck REQUIRED)
haarlight_hard_test(numbers SOURCES numbers_lighting numbers_basis numbers_floats USES haarlight_prt)
haarlight_hard_test(properties SOURCES properties USES haarlight_cpca rapidcheck)
haarlight_hard_test(long SOURCES long_run USES haarlight_prt)
haarlight_hard_test(geometry SOURCES geometry_lobes geometry_rays USES haarlight_precompute)
haarlight_hard_test(determinism SOURCES determinism USES haarlight_precompute haarlight_cpca
  XxHash::XxHash)
haarlight_hard_test(clusters SOURCES clusters USES haarlight_cpca)
haarlight_hard_test(factors SOURCES factors USES haarlight_precompute)
haarlight_hard_test(caching SOURCES caching instant_caching USES haarlight_caching)

haarlight_hard_test(files SOURCES files_damage USES haarlight_fuzz_targets XxHash::XxHash)
haarlight_hard_test(models SOURCES files_models USES haarlight_fuzz_targets XxHash::XxHash)

# A library preloaded into the programs under test, which makes their writes fail; and a program that
# writes what haarlight writes beside transports and pictures.
add_library(haarlight_fault_shim SHARED hard/fault_shim.cpp)
target_include_directories(haarlight_fault_shim PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(haarlight_fault_shim PRIVATE haarlight_flags ${CMAKE_DL_LIBS})
# It stands before all else in the program, where a sanitizer's own library is not there yet.
target_compile_options(haarlight_fault_shim PRIVATE -fno-sanitize=all)
target_link_options(haarlight_fault_shim PRIVATE -fno-sanitize=all)
add_executable(haarlight-fault-writer hard/fault_writer.cpp)
target_include_directories(haarlight-fault-writer PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(haarlight-fault-writer PRIVATE haarlight_prt haarlight_flags fmt::fmt)
haarlight_hard_test(faults SOURCES files_faults USES haarlight_core)
target_compile_definitions(test_hard_faults PRIVATE
  HAARLIGHT_PROGRAM="$<TARGET_FILE:haarlight>"
  HAARLIGHT_FAULT_SHIM="$<TARGET_FILE:haarlight_fault_shim>"
  HAARLIGHT_FAULT_WRITER="$<TARGET_FILE:haarlight-fault-writer>")
add_dependencies(test_hard_faults haarlight haarlight_fault_shim haarlight-fault-writer)

find_package(Python3 REQUIRED COMPONENTS Interpreter)
add_test(NAME HardCases.PlantedFaultsFitTheTree
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/planted.py --apply-only)
set_tests_properties(HardCases.PlantedFaultsFitTheTree PROPERTIES LABELS hard TIMEOUT 60)
# After all rows' tests, whose reports it reads. Sanitizers allow themselves other limits of memory.
if(NOT HAARLIGHT_SANITIZE)
  add_test(NAME StabilityTable.StatesWhatTestsReport
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/stability_table.py --check
      --reports ${HARD_CASES_FOLDER} --binaries ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
  set_tests_properties(StabilityTable.StatesWhatTestsReport PROPERTIES LABELS hard TIMEOUT 60
    FIXTURES_REQUIRED hard_cases)
endif()
