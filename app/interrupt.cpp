#include "app/interrupt.h"

#include <csignal>

namespace medulla {

static volatile std::sig_atomic_t interrupted = 0;

void noteInterrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
}

void throwIfInterrupted() {
  if (interrupted) throw Interrupted();
}

}  // namespace medulla
