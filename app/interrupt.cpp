#include "app/interrupt.h"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace medulla {

namespace {

// Read by other threads than the one that the signal interrupts, so that a volatile sig_atomic_t would not do.
std::atomic<bool> requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // what a signal handler may write

extern "C" void onSignal(int) {
  requested = true;
}

}  // namespace

void watchInterrupts() {
  struct sigaction action = {};
  action.sa_handler = onSignal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction former = {};
    sigaction(signal, nullptr, &former);
    if (former.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
  for (const int signal : {SIGXFSZ, SIGPIPE}) std::signal(signal, SIG_IGN);
}

void checkInterrupt() {
  if (requested) throw Interrupted();
}

}  // namespace medulla
