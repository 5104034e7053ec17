haarlight_test(viewer/session haarlight_viewer)
haarlight_test(viewer/scene_session haarlight_viewer haarlight_data_gen)
haarlight_test(viewer/session_clusters haarlight_viewer)
haarlight_test(viewer/worker haarlight_viewer)
haarlight_test(viewer/lighting_picture haarlight_viewer)
haarlight_test(viewer/preferences haarlight_viewer)
haarlight_test(viewer/program haarlight_prt)
target_compile_definitions(test_viewer_program PRIVATE
  HAARLIGHT_PROGRAM="$<TARGET_FILE:haarlight-view>" HAARLIGHT_RELIGHT="$<TARGET_FILE:haarlight>"
  HAARLIGHT_HAS_WINDOW=$<BOOL:${HAARLIGHT_HAS_WINDOW}>)
add_dependencies(test_viewer_program haarlight-view haarlight)

# The window itself, under a virtual display with software OpenGL.
find_program(XVFB_RUN xvfb-run)
find_program(XVFB Xvfb)
if(HAARLIGHT_HAS_WINDOW AND XVFB_RUN AND XVFB)
  haarlight_test(viewer/window haarlight_prt haarlight_data_gen)
  target_compile_definitions(test_viewer_window PRIVATE HAARLIGHT_PROGRAM="${XVFB_RUN}"
    HAARLIGHT_VIEW="$<TARGET_FILE:haarlight-view>" HAARLIGHT_RELIGHT="$<TARGET_FILE:haarlight>")
  add_dependencies(test_viewer_window haarlight-view haarlight)
else()
  message(STATUS "The window is not tested: window ${HAARLIGHT_HAS_WINDOW}, Xvfb ${XVFB}")
endif()
