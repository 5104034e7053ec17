# Slow, plainly right versions that tests of other folders compare with.
add_library(haarlight_reference STATIC
  reference/path_tracer.cpp reference/sky.cpp reference/triangle_tree.cpp)
target_include_directories(haarlight_reference PUBLIC ${PROJECT_SOURCE_DIR})
target_link_libraries(haarlight_reference
  PUBLIC haarlight_precompute haarlight_wavelet haarlight_core PRIVATE haarlight_flags)

haarlight_test(reference/path_tracer_test haarlight_reference)
haarlight_test(reference/triangle_tree_test haarlight_reference)
