// pendula-kernel: the program that Jupyter starts for a notebook; `pendula kernel install` registers it.
#include <csignal>
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>
#include <xeus/xhelper.hpp>
#include <xeus/xkernel.hpp>
#include <xeus/xkernel_configuration.hpp>
#include <xeus/xserver_zmq.hpp>
#include <zmq.hpp>

#include "kernel/interpreter.hpp"
#include "shell/input/signals.hpp"

namespace {

/// Threads started after this call inherit the mask; SIGINT is unblocked only while a cell runs.
void block_interrupt() {
  sigset_t interrupt;
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGINT);
  pthread_sigmask(SIG_BLOCK, &interrupt, nullptr);
  pendula::shell::catch_interrupt_in_session();
}

int serve(const std::string& connection) {
  auto context = xeus::make_context<zmq::context_t>();
  const xeus::xconfiguration configuration = xeus::load_configuration(connection);
  xeus::xkernel kernel(configuration, xeus::get_user_name(), std::move(context),
                       pendula::kernel::make_interpreter(), xeus::make_xserver_zmq,
                       xeus::make_in_memory_history_manager(), nullptr, xeus::make_null_debugger,
                       nl::json::object(), nl::json::error_handler_t::replace);
  kernel.start();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  block_interrupt();
  const std::string connection = xeus::extract_filename(argc, argv);
  if (connection.empty()) {
    std::fputs("usage: pendula-kernel -f connection.json (Jupyter does this; see pendula kernel --help)\n",
               stderr);
    return 2;
  }
  try {
    return serve(connection);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "pendula-kernel: %s\n", e.what());
    return 1;
  }
}
