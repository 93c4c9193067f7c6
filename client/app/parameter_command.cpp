#include "client/app/parameter_command.h"

#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "client/app/ctl_commands.h"
#include "client/app/notice_list.h"
#include "common/base/profile.h"
#include "common/client/attempts.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kParametersTimeout{5'000};
constexpr std::chrono::hours kWatchPatience{24 * 365};

/// One list that answers a request; changes that come meanwhile are in the next answer anyway.
Result<ParameterList> ask(ViewerClient& client, const ParameterRequest& request,
                          const std::atomic<bool>& stop) {
  RETURN_IF_ERROR(client.send(request));
  const int64_t end_ns = now_ns() + std::chrono::nanoseconds(kParametersTimeout).count();
  while (now_ns() < end_ns) {
    if (stop) return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
    for (ClientEvent& event : client.wait(milliseconds(50))) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
      const auto* notice = std::get_if<Notice>(&event);
      if (notice != nullptr && notice->is_error)
        return make_error(ErrorCode::Unavailable, "{}", notice->text);
      if (auto* list = std::get_if<ParameterList>(&event); list != nullptr && !list->is_change)
        return std::move(*list);
    }
  }
  return make_error(ErrorCode::Timeout, "the server does not list its parameters: is it an older one?");
}

Result<uint32_t> print_all(ViewerClient& client, const ParameterOptions& options,
                           const std::atomic<bool>& stop) {
  ParameterRequest request{options.prefix, 0, options.is_watching};
  while (true) {
    ASSIGN_OR_RETURN(const ParameterList list, ask(client, request, stop));
    for (const ParameterInfo& parameter : list.parameters)
      if (parameter.is_live || !options.is_live_only) std::cout << to_line(parameter) << '\n';
    request.first += static_cast<uint32_t>(list.parameters.size());
    if (list.parameters.empty() || request.first >= list.total) return list.total;
  }
}

/// Prints changes until stopped. After a lost connection, prints the whole list again.
int watch(std::unique_ptr<ViewerClient> client, const ClientConfig& config, const ParameterOptions& options,
          const std::atomic<bool>& stop) {
  LineBudget lines;
  std::optional<Error> lost;
  while (!stop && std::cout) {
    if (lost) {
      std::cerr << fmt::format("strandcast-ctl: {}; trying again\n", lost->to_string());
      auto again = connect_patiently(config, kWatchPatience, Standing::Member);
      if (!again) return ctl_failure(again.error(), kRefusedExit);
      client = std::move(*again);
      lost.reset();
      if (const auto listed = print_all(*client, options, stop); !listed) lost = listed.error();
    }
    for (const ClientEvent& event : client->wait(milliseconds(100))) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) lost = closed->error;
      const auto* list = std::get_if<ParameterList>(&event);
      if (list == nullptr || !list->is_change) continue;
      for (const ParameterInfo& parameter : list->parameters)
        if (lines.take(now_ns())) std::cout << to_line(parameter) << std::endl;
    }
  }
  return kDoneExit;
}

}  // namespace

std::string to_line(const ParameterInfo& parameter) {
  constexpr size_t kPathWidth = 36;
  const auto named = [&](const std::string& value) { return value.empty() ? std::string("\"\"") : value; };
  const std::string unit = parameter.unit.empty() ? "" : " " + parameter.unit;
  std::string facts;
  const auto add = [&](const std::string& fact) { facts += (facts.empty() ? "" : ", ") + fact; };
  if (parameter.has_range) add(fmt::format("{:g} .. {:g}{}", parameter.minimum, parameter.maximum, unit));
  if (parameter.unset_value != parameter.value) add("default " + named(parameter.unset_value));
  if (!parameter.note.empty()) add(parameter.note);
  if (!parameter.is_live) add("fixed while running");
  return fmt::format("{:<{}} {}{}{}", parameter.path, kPathWidth, named(parameter.value), unit,
                     facts.empty() ? "" : "   (" + facts + ")");
}

int run_params(const CtlTarget& target, const ParameterOptions& options, const std::atomic<bool>& stop) {
  auto config = client_config_for(target, Role::Viewer);
  if (!config) return ctl_failure(config.error(), kBadInputExit);
  config->hello.gets_no_stream = true;
  auto client = connect_patiently(*config);
  if (!client) return ctl_failure(client.error(), kBadInputExit);
  const auto listed = print_all(**client, options, stop);
  if (!listed) return ctl_failure(listed.error(), kRefusedExit);
  if (*listed == 0) {
    std::cerr << fmt::format("strandcast-ctl: no parameter begins with '{}'\n", options.prefix);
    return kRefusedExit;
  }
  std::cout << std::flush;
  return options.is_watching ? watch(std::move(*client), *config, options, stop) : kDoneExit;
}

}  // namespace strandcast
