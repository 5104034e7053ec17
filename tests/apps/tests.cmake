foreach(source apps/command_line apps/bad_input apps/end_to_end apps/long_runs)
  haarlight_test(${source} haarlight_core nlohmann_json::nlohmann_json)
  string(REPLACE "/" "_" name ${source})
  target_compile_definitions(test_${name} PRIVATE HAARLIGHT_PROGRAM="$<TARGET_FILE:haarlight>")
  add_dependencies(test_${name} haarlight)
endforeach()
# With MPI, the same bytes from several processes.
if(HAARLIGHT_MPIEXEC)
  haarlight_test(apps/several_processes haarlight_core)
  target_compile_definitions(test_apps_several_processes PRIVATE
    HAARLIGHT_PROGRAM="$<TARGET_FILE:haarlight>" HAARLIGHT_MPIEXEC="${HAARLIGHT_MPIEXEC}")
  add_dependencies(test_apps_several_processes haarlight)
endif()
