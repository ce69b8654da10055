#include "apps/youbotd/page.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <future>
#include <sstream>
#include <utility>

#include "apps/youbotd/freshness.h"
#include "apps/youbotd/page_assets.h"
#include "apps/youbotd/request.h"
#include "control/robot_model.h"
#include "hal/setup_error.h"
#include "report/assets.h"
#include "runtime/log.h"
#include "runtime/program/build_info.h"
#include "runtime/program/control_socket.h"

namespace youbotd {
namespace {

using live::Response;
using nlohmann::json;

constexpr std::string_view kTokenWord = "token ";
constexpr std::uintmax_t kMaxFaultReport_bytes = 4 << 20;
constexpr const char* kPcapng = ".pcapng";
/// A web application that reads the stream.
constexpr std::string_view kFoxglove = "https://app.foxglove.dev";

struct Asset {
  std::string_view path;
  std::string_view type;
  std::string_view body;
};
constexpr std::string_view kHtml = "text/html; charset=utf-8";
constexpr std::string_view kStyle = "text/css; charset=utf-8";
constexpr std::string_view kScript = "text/javascript; charset=utf-8";

const std::array<Asset, 13>& assets() {
  static const std::array<Asset, 13> all{{{"/", kHtml, kPageHtml},
                                          {"/page.css", kStyle, kPageStyle},
                                          {"/page.js", kScript, kPageScript},
                                          {"/stop.js", kScript, kStopScript},
                                          {"/stream.js", kScript, kStreamScript},
                                          {"/robot.js", kScript, kRobotScript},
                                          {"/plots.js", kScript, kPlotsScript},
                                          {"/three.js", kScript, kThreeScript},
                                          {"/orbit.js", kScript, kOrbitScript},
                                          {"/three-license.txt", "text/plain; charset=utf-8", kThreeLicense},
                                          {"/dygraph.js", kScript, report::kDygraphsScript},
                                          {"/dygraph.css", kStyle, report::kDygraphsStyle},
                                          {"/robot.urdf", "application/xml", control::youbot_urdf()}}};
  return all;
}

/// Empty if it cannot be read or is too large to be a fault report.
std::string small_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > kMaxFaultReport_bytes) return {};
  std::ifstream in(path, std::ios::binary);
  std::stringstream content;
  content << in.rdbuf();
  return in ? std::move(content).str() : std::string();
}

/// 128 random bits.
std::string make_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw hal::SetupError("page", std::string("random number: ") + std::strerror(errno),
                          "start youbotd again");
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string token;
  for (const unsigned char byte : bytes) {
    token += kDigits[byte >> 4U];
    token += kDigits[byte & 15U];
  }
  return token;
}

/// In a time that does not depend on where they differ.
bool same_token(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

/// Paths come from outside and may not be UTF-8.
std::string text(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

std::string refusal(const std::string& why) { return text({{"ok", false}, {"error", why}}); }

/// Finite numbers only: JSON has no others.
json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json json_of(const hal::JointInfo& joint) {
  return {{"name", joint.name},
          {"torque_limit_Nm", number(std::min(joint.torque_limit_Nm, joint.rated_torque_Nm))},
          {"speed_limit_rad_per_s", number(joint.speed_limit_rad_per_s)},
          {"lower_rad", number(joint.range.lower_rad)},
          {"upper_rad", number(joint.range.upper_rad)}};
}

/// [lower corner, upper corner]; null without limits.
template <int kAxes>
json json_of(const Eigen::AlignedBox<double, kAxes>& box_m) {
  if (!box_m.min().allFinite() || !box_m.max().allFinite()) return nullptr;
  json corners = json::array();
  for (const auto& corner : {box_m.min(), box_m.max()}) {
    json numbers = json::array();
    for (int i = 0; i < kAxes; ++i) numbers.push_back(corner[i]);
    corners.push_back(std::move(numbers));
  }
  return corners;
}

}  // namespace

/// Commands of one page. The first message may give the token.
class Page::CommandSession final : public live::Conversation {
 public:
  CommandSession(Page& page, live::WebSocket& socket)
      : page_(page), socket_(std::make_shared<live::WebSocket*>(&socket)) {
    constexpr std::uint64_t kPages = std::uint64_t{1}
                                     << 63;  // apart from the connections of the control socket
    peer_.connection = kPages + ++page.sessions_;
    peer_.name = "the page at " + socket.client();
    peer_.heard = std::chrono::steady_clock::now();
    (void)freshness_.hear(peer_.heard);  // the connection itself
  }
  ~CommandSession() override { page_.commands_.gone(peer_); }

  void hear(std::string_view message) override {
    peer_.heard = std::chrono::steady_clock::now();
    const bool fresh = freshness_.hear(peer_.heard);
    const std::string_view command = command_of(message);
    if (!fresh && (command == "enable" || command == "acknowledge"))
      return reply(
          refusal("this page was silent, and the request may have waited in the network: send it again"));
    if (message.starts_with(kTokenWord)) {
      peer_.may_command = same_token(message.substr(kTokenWord.size()), page_.token_);
      return reply(peer_.may_command
                       ? json{{"ok", true}, {"name", peer_.name}}.dump()
                       : refusal("this token is not of this start of youbotd: open the address that "
                                 "it printed, or go on without commands"));
    }
    if (message.empty() || message.size() > runtime::kLongestRequest)
      return reply(refusal("a request has 1 to 4096 characters"));
    page_.commands_.ask(peer_, std::string(message),
                        [server = page_.server_.get(), to = std::weak_ptr(socket_)](std::string answer) {
                          server->post([to, answer = std::move(answer)] {
                            if (const auto socket = to.lock())
                              (*socket)->send(answer, live::WebSocket::Format::kText,
                                              live::WebSocket::Need::kMust);
                          });
                        });
  }

 private:
  void reply(const std::string& answer) {
    (*socket_)->send(answer, live::WebSocket::Format::kText, live::WebSocket::Need::kMust);
  }

  Page& page_;
  std::shared_ptr<live::WebSocket*> socket_;  // expires with the connection
  Peer peer_;
  Freshness freshness_;
};

Page::Page(Options options, operation::LiveFeed& feed, Commands& commands)
    : options_(std::move(options)),
      feed_(feed),
      reader_(feed.add_reader()),
      commands_(commands),
      token_(make_token()),
      stream_(std::string("youbotd ") + runtime::build_version()),
      channels_(stream_, options_.teleoperated, options_.geometry),
      status_(options_.first_status),
      live_status_(feed_, reader_, options_.commanded),
      server_(std::make_unique<live::WebServer>(options_.where, *this)) {
  server_->start();
}

Page::~Page() = default;

void Page::post_status(json status, std::function<void()> then) {
  const std::string path = status.value("fault_report", "");
  if (path != reported_->path) {
    FaultFiles files{.path = path, .by_extension = {}};
    if (!path.empty()) {
      files.by_extension[""] = small_file(path);
      files.by_extension[kPcapng] = small_file(std::filesystem::path(path).replace_extension(kPcapng));
    }
    reported_ = std::make_shared<const FaultFiles>(std::move(files));
  }
  server_->post([this, files = reported_, status = std::move(status), then = std::move(then)]() mutable {
    fault_ = files;
    status_ = std::move(status);
    then();
  });
}

void Page::publish_status(json status) {
  post_status(std::move(status), [] {});
}

void Page::send_last_status(json status) {
  const auto sent = std::make_shared<std::packaged_task<void()>>([this] { send_status(); });
  std::future<void> done = sent->get_future();
  post_status(std::move(status), [sent] { (*sent)(); });
  constexpr std::chrono::seconds kPatience{1};
  (void)done.wait_for(kPatience);
}

void Page::set_joints(std::span<const hal::JointInfo> joints) {
  server_->post(
      [this, all = std::vector(joints.begin(), joints.end())]() mutable { joints_ = std::move(all); });
}

Response Page::answer(const live::Request& request) {
  if (request.method == live::Request::Method::kPost) {
    if (request.path != "/stop") return {.status = 404, .body = "only /stop takes a POST\n"};
    if (!request.same_origin) return {.status = 403, .body = "only from the page itself\n"};
    commands_.stop("the page at " + request.client);
    return {.status = 202, .body = "the robot comes to rest\n"};
  }
  if (request.path == "/info.json") return {.type = "application/json", .body = text(info())};
  if (request.path == "/fault-report" || request.path == "/fault-report.pcapng")
    return fault_report(request.path == "/fault-report" ? "" : kPcapng);
  for (const Asset& asset : assets())
    if (asset.path == request.path) return {.type = std::string(asset.type), .body = std::string(asset.body)};
  return {.status = 404, .body = "there is no " + request.path + " here\n"};
}

Response Page::fault_report(const std::string& extension) const {
  const auto file = fault_->by_extension.find(extension);
  if (file == fault_->by_extension.end() || file->second.empty())
    return {.status = 404, .body = "there is no such file of a fault\n"};
  std::filesystem::path name = std::filesystem::path(fault_->path).filename();
  if (!extension.empty()) name.replace_extension(extension);
  return {.type = "application/octet-stream", .body = file->second, .file_name = name.string()};
}

json Page::info() const {
  json joints = json::array();
  for (const hal::JointInfo& joint : joints_) joints.push_back(json_of(joint));
  json checks = json::array();
  for (const Finding& finding : options_.checks)
    if (finding.mark != Finding::Mark::kOk)
      checks.push_back({{"mark", finding.mark == Finding::Mark::kWarn ? "warn" : "fail"},
                        {"found", finding.found},
                        {"remedy", finding.remedy}});
  return {{"version", runtime::build_version()},
          {"teleoperated", options_.teleoperated},
          {"commanded", options_.commanded},
          {"modes", options_.modes},
          {"joints", std::move(joints)},
          {"columns", channels_.columns()},
          {"workspace",
           {{"base", json_of(options_.workspace.base_W_m)},
            {"end_effector", json_of(options_.workspace.tip_W_m)}}},
          {"checks", std::move(checks)}};
}

/// Clients of Foxglove's protocol connect to the address itself.
std::optional<live::Site::Opening> Page::open(const live::Request& request) {
  auto protocol = live::FoxgloveStream::protocol(request.protocols);
  if (protocol && (request.same_origin || request.origin == kFoxglove))
    return Opening{[this](live::WebSocket& socket) { return stream_.converse(socket); },
                   std::move(*protocol)};
  if (request.path == "/control" && request.same_origin)
    return Opening{
        [this](live::WebSocket& socket) { return std::make_unique<CommandSession>(*this, socket); }};
  return std::nullopt;
}

void Page::tick() {
  if (joints_.empty())
    feed_.with_robot(
        [&](const hal::Robot& robot) { joints_.assign(robot.joints().begin(), robot.joints().end()); });
  operation::LiveSample sample;
  while (reader_.take(sample)) {
    channels_.publish(sample);
    live_status_.hear(sample);
  }
  if (std::chrono::steady_clock::now() - published_ >= kStatusPeriod) send_status();
}

void Page::send_status() {
  published_ = std::chrono::steady_clock::now();
  json status = status_;
  status["fault_frames"] =
      fault_->by_extension.contains(kPcapng) && !fault_->by_extension.at(kPcapng).empty();
  live_status_.complete(status);
  channels_.publish_status(feed_.now_ns(), status);
}

void announce(const Page& page) {
  spdlog::info("page: {}", page.url());
  if (!page.local_only())
    spdlog::warn(
        "everyone who reaches this address can see this robot and stop it, and nothing is encrypted");
}

}  // namespace youbotd
