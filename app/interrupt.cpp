#include "app/interrupt.h"

#include <csignal>
#include <initializer_list>

namespace medulla {

namespace {

volatile std::sig_atomic_t requested = 0;

extern "C" void onSignal(int) {
  requested = 1;
}

}  // namespace

void watchInterrupts() {
  struct sigaction action = {};
  action.sa_handler = onSignal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

bool interruptRequested() {
  return requested != 0;
}

void checkInterrupt() {
  if (interruptRequested()) throw Interrupted();
}

}  // namespace medulla
