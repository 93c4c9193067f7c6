// Command line of strandcast-ctl. Pure parsing; it runs nothing.
#pragma once

#include "client/app/ctl_table.h"

namespace strandcast {

/// Result of reading a command line: a command that can be called, or an exit code after help or an error was
/// printed.
struct CtlChoice {
  const CtlCommand* command = nullptr;
  CtlCommandLine line;
  int exit_code = kDoneExit;
};
CtlChoice read_ctl_command_line(int argc, const char* const* argv);

}  // namespace strandcast
