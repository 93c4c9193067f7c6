// strandcast-ctl: feeds, watches, steers and checks a running server from the command line.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <utility>

#include "client/app/ctl_table.h"
#include "client/app/stop_signal.h"
#include "client/app/view_options.h"
#include "common/base/command_line_error.h"
#include "common/base/output_file.h"
#include "common/base/version.h"
#include "common/log/log.h"

namespace {

using namespace strandcast;

/// A command and what was made of it for the command line.
using DeclaredCommand = std::pair<const CtlCommand*, CLI::App*>;

void declare_target(CLI::App& app, CtlTarget& target) {
  app.add_option("--connect", target.connect, "Server as HOST:PORT")->capture_default_str();
  app.add_option("--token-file", target.token_file,
                 "File with the token: the token alone, or lines 'role token'");
  app.add_option("--token", target.token, kTokenHelp)->envname(kTokenVariable);
  app.add_flag("--tls", target.is_tls, "Encrypt the connection, as an address with wss:// does");
  app.add_option("--tls-ca", target.tls_authorities, kTlsAuthoritiesHelp);
  app.add_option(
      "--head", target.head,
      "Of a server with several heads the one of this name (default: the first; feed and record: all)");
}

std::vector<DeclaredCommand> declare_commands(CLI::App& app, CtlCommandLine& line) {
  std::vector<DeclaredCommand> declared;
  for (const CtlCommand& command : ctl_commands()) {
    const std::string name = command.name;
    const size_t space = name.find(' ');
    CLI::App& above = space == std::string::npos ? app : *app.get_subcommand(name.substr(0, space));
    CLI::App* own = above.add_subcommand(name.substr(space + 1), command.summary);  // npos + 1 = 0
    if (command.run == nullptr) own->require_subcommand(1);
    if (command.declare != nullptr) command.declare(*own, line);
    declared.emplace_back(&command, own);
  }
  return declared;
}

/// What to say when no command was understood but there are words left; empty otherwise.
std::string unknown_command(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining();
  if (!app.get_subcommands().empty() || words.empty()) return {};
  std::string known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    known += (known.empty() ? "" : ", ") + command->get_name();
  return fmt::format("unknown command or option '{}' (commands: {}; --help says more)", words.front(), known);
}

int run(int argc, char** argv) {
  CLI::App app("Strandcast control: feeds, watches, steers and checks a running strandcast-server.",
               "strandcast-ctl");
  app.set_version_flag("--version", fmt::format("strandcast-ctl {}", version()));
  CtlCommandLine line;
  std::string log_level = "warn";
  app.failure_message(command_line_failure<CLI::App, CLI::Error>);
  app.require_subcommand(1);
  app.fallthrough();  // --connect may stand behind the sub-command too
  declare_target(app, line.target);
  app.add_option("--log", log_level, "error, warn, info, debug or off")->capture_default_str();
  const std::vector<DeclaredCommand> commands = declare_commands(app, line);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    if (const std::string unknown = unknown_command(app); !unknown.empty()) {
      std::cerr << "strandcast-ctl: " << unknown << '\n';
      return kBadInputExit;
    }
    return app.exit(problem) == 0 ? kDoneExit : kBadInputExit;
  }
  if (!init_log(log_level)) {
    std::cerr << "strandcast-ctl: unknown log level '" << log_level
              << "' (known: error, warn, info, debug, off)\n";
    return kBadInputExit;
  }
  line.names_server = app.count("--connect") > 0;
  const auto& stop = catch_stop_signals();
  line.target.stop = &stop;
  for (const auto& [command, parsed] : commands)
    if (*parsed && command->run != nullptr) return command->run(line, stop);
  return kBadInputExit;
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
