haarlight_test(wavelet/haar haarlight_wavelet)
haarlight_test(wavelet/top_k haarlight_wavelet)
