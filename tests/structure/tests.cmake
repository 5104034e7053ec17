find_package(Python3 REQUIRED COMPONENTS Interpreter)
add_test(NAME Structure.TreeKeepsItsRules
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/check_structure.py)
add_test(NAME Structure.CheckerFindsWhatItShould
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/check_structure_test.py)
set_tests_properties(Structure.TreeKeepsItsRules Structure.CheckerFindsWhatItShould
  PROPERTIES LABELS structure TIMEOUT 120)
