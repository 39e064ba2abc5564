-- Pictures: what a user hands over becomes the table that figure{…} reads (src/lua/bind/plot). Columns are
-- lists of numbers or numeric matrices; a matrix of several columns is several curves.

plotting = {}                                    -- what the files of stdlib/plot share
plotting.options = include "plot/options"        -- one row per option
plotting.arguments = include "plot/arguments"    -- reading what is handed over
plotting.series = include "plot/series"          -- curves from columns and solutions
include "plot/flat"        -- plot, semilogy, semilogx, loglog, band
include "plot/space"       -- plot3
include "plot/pages"       -- overlay, layout
include "plot/pattern"     -- spy
include "plot/grid"        -- heatmap, contour
include "plot/histogram"   -- histogram
include "plot/phase"       -- phase, poincare
include "plot/animation"   -- animate
