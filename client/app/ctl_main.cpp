// strandcast-ctl: feeds, watches, steers and checks a running server from the command line.
#include <exception>
#include <iostream>

#include "client/app/ctl_options.h"
#include "client/app/stop_signal.h"
#include "common/base/output_file.h"
#include "common/log/log.h"

namespace {

using namespace strandcast;

int run(int argc, char** argv) {
  CtlChoice choice = read_ctl_command_line(argc, argv);
  if (choice.command == nullptr) return choice.exit_code;
  if (!init_log(choice.line.log_level)) {
    std::cerr << "strandcast-ctl: unknown log level '" << choice.line.log_level
              << "' (known: error, warn, info, debug, off)\n";
    return kBadInputExit;
  }
  const auto& stop = catch_stop_signals();
  choice.line.target.stop = &stop;
  return carry_out(*choice.command, choice.line, stop);
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_files();
  try {
    return run(argc, argv);
  } catch (const std::exception& failure) {
    std::cerr << "strandcast-ctl: " << failure.what() << '\n';
    return strandcast::kBadInputExit;
  }
}
