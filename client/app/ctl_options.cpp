#include "client/app/ctl_options.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <utility>

#include "client/app/view_options.h"
#include "common/base/command_line_error.h"
#include "common/base/version.h"

namespace strandcast {
namespace {

/// Whether it does something itself, and does not only hold sub-commands.
bool is_callable(const CtlCommand& command) {
  return command.run != nullptr || command.message != nullptr;
}

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
    if (!is_callable(command)) own->require_subcommand(1);
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

}  // namespace

CtlChoice read_ctl_command_line(int argc, const char* const* argv) {
  CLI::App app("Strandcast control: feeds, watches, steers and checks a running strandcast-server.",
               "strandcast-ctl");
  app.set_version_flag("--version", fmt::format("strandcast-ctl {}", version()));
  CtlCommandLine line;
  app.failure_message(command_line_failure<CLI::App, CLI::Error>);
  app.require_subcommand(1);
  app.fallthrough();  // --connect may stand behind the sub-command too
  declare_target(app, line.target);
  app.add_option("--log", line.log_level, "error, warn, info, debug or off")->capture_default_str();
  const std::vector<DeclaredCommand> commands = declare_commands(app, line);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    if (const std::string unknown = unknown_command(app); !unknown.empty()) {
      std::cerr << "strandcast-ctl: " << unknown << '\n';
      return {nullptr, {}, kBadInputExit};
    }
    return {nullptr, {}, app.exit(problem) == 0 ? kDoneExit : kBadInputExit};
  }
  line.test.uses_running = app.count("--connect") > 0;
  for (const auto& [command, parsed] : commands)
    if (*parsed && is_callable(*command)) return {command, std::move(line), kDoneExit};
  return {nullptr, {}, kBadInputExit};
}

}  // namespace strandcast
