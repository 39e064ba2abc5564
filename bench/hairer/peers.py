"""DOP853 and RADAU5, Hairer's Fortran codes, as Debian has them: the first in python3-scipy, the second in
r-cran-desolve; right-hand sides and Jacobians are compiled C (models.c)."""
import ctypes
import glob
import time

import numpy as np
from scipy.integrate import _dop

capsule = ctypes.pythonapi.PyCapsule_New
capsule.restype = ctypes.py_object
capsule.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]


def native(function):
    """A C function, in place of a Python one, for f2py."""
    return capsule(ctypes.cast(function, ctypes.c_void_p), None, None)


class Peers:
    def __init__(self, models):
        self.models = ctypes.CDLL(models)
        ctypes.CDLL("/usr/lib/R/lib/libR.so", ctypes.RTLD_GLOBAL)
        place = glob.glob("/usr/lib/R/*/deSolve/libs/deSolve.so")[0]
        self.radau = ctypes.CDLL(place).radau5_
        self.price_of_call = self.measured_price_of_call()

    def dop853(self, name, pieces, y, rtol, atol):
        """Seconds of processor time, the end; the price of a call from Python is taken off."""
        fcn = native(getattr(self.models, name))
        n = len(y)
        work, iwork = np.zeros(11 * n + 21), np.zeros(21, np.int32)
        iwork[0], iwork[3] = 1_000_000, -1  # steps; not watched for stiffness

        def run(t, y, end):
            begin = time.process_time()
            _, y, iw, idid = _dop.dop853(fcn, t, y, end, rtol, atol, fcn, 0, work.copy(), iwork.copy())
            return time.process_time() - begin, y if idid > 0 else None

        total = 0
        for t, end in zip(pieces, pieces[1:]):
            seconds, y = run(t, y, end)
            total += seconds - self.price_of_call
            if y is None:
                return total, None
        return total, y

    def measured_price_of_call(self):
        """Of one unknown that stays where it is: two evaluations and a step of nothing."""
        self.price_of_call = 0
        return min(self.dop853("still", [0, 1], np.ones(1), 1e-3, 1e-3)[0] for _ in range(1000))

    def radau5(self, name, pieces, y, rtol, atol, lower, upper, second=0):
        """lower, upper: of the band, None: full. second: the first unknowns whose derivatives are others."""
        n = len(y)
        fcn = getattr(self.models, name)
        banded = lower is not None
        jac = getattr(self.models, name + "_jac") if banded else fcn
        i, d = (lambda k: ctypes.byref(ctypes.c_int(k))), (lambda v: ctypes.byref(ctypes.c_double(v)))
        width = n - second
        ldj, lde = (lower + upper + 1, 2 * lower + upper + 1) if banded else (width, width)
        work = np.zeros(n * (ldj + 12) + 3 * lde * n + 20)
        iwork = np.zeros(3 * n + 20, np.int32)
        iwork[1], iwork[8] = 1_000_000, second
        y = np.array(y, float)
        fill = lambda a: a.ctypes.data_as(ctypes.c_void_p)
        tolerances = fill(np.full(1, rtol)), fill(np.full(1, atol))
        total = 0
        for t, end in zip(pieces, pieces[1:]):
            x, idid = ctypes.c_double(t), ctypes.c_int(0)
            ml, mu = (lower, upper) if banded else (n, 0)
            begin = time.process_time()
            self.radau(i(n), fcn, ctypes.byref(x), fill(y), d(end), d(0), *tolerances, i(0), jac, i(int(banded)), i(ml),
                       i(mu), fcn, i(0), i(n), i(0), self.models.silent, i(0), fill(work), i(len(work)), fill(iwork),
                       i(len(iwork)), None, None, ctypes.byref(idid))
            total += time.process_time() - begin
            if idid.value < 0:
                return total, None
        return total, y
