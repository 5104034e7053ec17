find_package(Python3 REQUIRED COMPONENTS Interpreter)
add_test(NAME Bench.EffectsAreJudgedRightly
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/effects_test.py)
set_tests_properties(Bench.EffectsAreJudgedRightly PROPERTIES LABELS bench TIMEOUT 60)
add_test(NAME Bench.CompareTellsSlowerFromNoise
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/compare_test.py)
set_tests_properties(Bench.CompareTellsSlowerFromNoise PROPERTIES LABELS bench TIMEOUT 60)
add_test(NAME Bench.PerceptualDifferenceIsFlip
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/perceptual_test.py)
set_tests_properties(Bench.PerceptualDifferenceIsFlip PROPERTIES LABELS bench TIMEOUT 60
  SKIP_REGULAR_EXPRESSION "SKIPPED")
