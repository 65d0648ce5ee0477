"""Films under a dead load and a field that is applied at once, or rises, and is held: sudden, ramp, ramp-and-hold.

With ``w = 1/lambda``, ``u = w**2``, ``r = xi**2``, ``p = mu_U/mu_R - 1``, ``A = 1 + p/r``, ``B = 1 + p r**2`` and the
dead load ``sigma``, the nominal stress over the relaxed modulus, (18) to (20) of Zhao, Koh and Suo (2011) are

    e = A w**2 - B w**8 - sigma w**3 = g(w) + p u**2 h,    g(w) = w**2 - w**8 - sigma w**3,
    dr/dT = 2 h,    h = 1/z - z**2,    z = r u,    D = 8 B w**6 + 3 sigma w - 2 A = -g'/w + 2 p u (3 z**2 - h),

the film being unstable at D = 0. All is written about the relaxed film under its largest load, e_t = g(w_t): with
d = w - w_t the difference e_t - g(w) = d**2 G(d) has no term that cancels (docs/theory/dead_load.md).
"""
