haarlight_test(core/atomic_file haarlight_core)
haarlight_test(core/image_io haarlight_core fmt::fmt)
haarlight_test(core/image_metrics haarlight_core)
haarlight_test(core/parallel haarlight_core)
