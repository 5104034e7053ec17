# The installed package is what a user gets: install it, build the example against it, run both.
add_test(NAME Install.ExampleBuildsAndAgreesWithTheProgram
  COMMAND ${CMAKE_COMMAND}
    -D BUILD=${CMAKE_BINARY_DIR}
    -D EXAMPLE=${PROJECT_SOURCE_DIR}/examples/relight_minimal
    -D WORK=${CMAKE_BINARY_DIR}/install_test
    -D CXX=${CMAKE_CXX_COMPILER}
    -D SANITIZE=${HAARLIGHT_SANITIZE}
    -P ${CMAKE_CURRENT_LIST_DIR}/install_test.cmake)
set_tests_properties(Install.ExampleBuildsAndAgreesWithTheProgram PROPERTIES
  LABELS install TIMEOUT ${HAARLIGHT_TEST_TIMEOUT})
