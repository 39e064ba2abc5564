// The language of a Jupyter kernel: cells, completion, inspection, by the protocol that xeus speaks.
#pragma once

#include <memory>

#include <xeus/xinterpreter.hpp>

namespace pendula::kernel {

/// One session. SIGINT must be blocked in every thread before the kernel starts (a signal while it waits for
/// a message ends xeus); a cell lets it through while it runs, and is stopped by it. Throws std::exception.
std::unique_ptr<xeus::xinterpreter> make_interpreter();

}  // namespace pendula::kernel
