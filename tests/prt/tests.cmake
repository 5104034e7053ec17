haarlight_test(prt/lighting_tracker haarlight_prt)
haarlight_test(prt/row_sums haarlight_prt)
haarlight_test(prt/transport haarlight_prt)
