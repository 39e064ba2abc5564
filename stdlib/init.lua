-- The load order of the stdlib. A file may use what the files before it define.
include "prelude"    -- doc{}
