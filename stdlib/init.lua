-- The load order of the stdlib. A file may use what the files before it define.
include "prelude"    -- doc{}
include "help"       -- help, apropos, examples
include "testing"    -- test, expect
include "files"      -- save, load
include "json"       -- json
include "models"     -- form:solve
include "prepare"    -- sys:prepare
include "session"    -- who, cd, ls, record, edit
include "explain"    -- explain
include "plot"       -- plot, plot3, semilogy, semilogx, loglog, spy
include "sysid"      -- d:plot, mod:plot, v:plot, set:plot
include "identification/init"  -- spa, impulse_estimate, rarx, tfest, uncertain …
include "lti"        -- step, bode, nyquist, pzmap … as figures
include "control/init"  -- sys:close, estimator, ekf
include "tableaus/init"  -- rk.euler, rk.rk4, …
include "laboratory"  -- pictures of newton and basins
include "many/init"   -- s:quantile, s:sobol, reliability, slurm …
include "converge"    -- converge
include "latex"       -- form:latex, bdf(2):latex
include "check"       -- sol:check
include "lookup"      -- lookup
include "algebra"     -- roots, equilibria, apart, integral, Laplace transforms
include "problems/init"  -- problems.pendulum, problems.akzo, …
include "asked"       -- what results were asked for
include "document"    -- view; reports and notebooks behind it
include "parts"       -- component, connect, model; components.electrical, …
