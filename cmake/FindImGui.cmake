# Dear ImGui with its GLFW and OpenGL 3 backends as imported target ImGui::ImGui. Debian's
# libimgui-dev is a static library with the backends inside, which needs stb, dl and GLFW.
find_path(ImGui_INCLUDE_DIR imgui.h PATH_SUFFIXES imgui)
find_path(ImGui_BACKENDS_INCLUDE_DIR imgui_impl_glfw.h PATH_SUFFIXES imgui/backends)
find_library(ImGui_LIBRARY imgui)
find_library(ImGui_STB_LIBRARY stb)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(ImGui DEFAULT_MSG ImGui_LIBRARY ImGui_INCLUDE_DIR
  ImGui_BACKENDS_INCLUDE_DIR ImGui_STB_LIBRARY)
if(ImGui_FOUND AND NOT TARGET ImGui::ImGui)
  add_library(ImGui::ImGui UNKNOWN IMPORTED)
  set_target_properties(ImGui::ImGui PROPERTIES IMPORTED_LOCATION ${ImGui_LIBRARY})
  target_include_directories(ImGui::ImGui INTERFACE
    ${ImGui_INCLUDE_DIR} ${ImGui_BACKENDS_INCLUDE_DIR})
  target_link_libraries(ImGui::ImGui INTERFACE ${ImGui_STB_LIBRARY} ${CMAKE_DL_LIBS})
endif()
mark_as_advanced(ImGui_INCLUDE_DIR ImGui_BACKENDS_INCLUDE_DIR ImGui_LIBRARY ImGui_STB_LIBRARY)
