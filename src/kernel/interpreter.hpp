// The language of a Jupyter kernel: cells, completion, inspection, by the protocol that xeus speaks.
//
// A cell runs in a session as an entry at the prompt does (shell/entry.hpp); its values and figures
// become displays: text, LaTeX, SVG. An interrupt arrives as SIGINT while a cell runs and is
// blocked otherwise, since xeus ends on it. The kernel is a program of its own (main.cpp), so that
// the shell does not link ZeroMQ.
#pragma once

#include <memory>

#include <xeus/xinterpreter.hpp>

namespace pendula::kernel {

/// One session. SIGINT must be blocked in every thread before the kernel starts (a signal while it waits for
/// a message ends xeus); a cell lets it through while it runs, and is stopped by it. Throws std::exception.
std::unique_ptr<xeus::xinterpreter> make_interpreter();

}  // namespace pendula::kernel
