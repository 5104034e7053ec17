haarlight_test(wavelet/haar haarlight_wavelet)
haarlight_test(wavelet/top_k haarlight_wavelet)
haarlight_test(wavelet/cubemap haarlight_wavelet)
haarlight_test(wavelet/projection haarlight_wavelet)
haarlight_test(wavelet/environment haarlight_wavelet)
target_compile_definitions(test_wavelet_environment PRIVATE
  HAARLIGHT_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
haarlight_test(wavelet/environment_cells haarlight_wavelet)
haarlight_test(wavelet/environment_sampler haarlight_wavelet)
target_compile_definitions(test_wavelet_environment_sampler PRIVATE
  HAARLIGHT_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
