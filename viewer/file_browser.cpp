// Lists folders, chooses files.

#include "viewer/file_browser.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <cctype>
#include <system_error>
#include <utility>

namespace haarlight::viewer {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

void FileBrowser::open(std::string title, std::vector<std::string> suffixes, Chosen chosen) {
  title_ = std::move(title);
  suffixes_ = std::move(suffixes);
  chosen_ = std::move(chosen);
  typed_.clear();
  std::error_code error;
  if (folder.empty() || !fs::is_directory(folder, error)) folder = fs::current_path(error);
  list();
  open_ = appear_ = true;
}

void FileBrowser::list() {
  entries_.clear();
  problem_.clear();
  std::error_code error;
  fs::directory_iterator files(folder, fs::directory_options::skip_permission_denied, error);
  if (error) {
    problem_ = fmt::format("{}: {}", folder.string(), error.message());
    return;
  }
  for (; files != fs::directory_iterator(); files.increment(error)) {
    if (error) break;
    const std::string name = files->path().filename().string();
    if (name.empty() || name[0] == '.') continue;
    std::error_code ignored;
    const bool is_folder = files->is_directory(ignored);
    const std::string suffix = lower(files->path().extension().string());
    const bool wanted = std::find(suffixes_.begin(), suffixes_.end(), suffix) != suffixes_.end();
    if (!is_folder && !wanted) continue;
    entries_.push_back({name, is_folder, is_folder ? 0 : files->file_size(ignored)});
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.is_folder != b.is_folder ? a.is_folder : lower(a.name) < lower(b.name);
  });
}

void FileBrowser::enter(const fs::path& place) {
  std::error_code error;
  const fs::path whole = place.is_absolute() ? place : folder / place;
  if (fs::is_directory(whole, error)) {
    folder = fs::weakly_canonical(whole, error);
    typed_.clear();
    list();
    return;
  }
  open_ = false;
  chosen_(whole);
}

void FileBrowser::draw(double scale) {
  if (!open_) return;
  if (appear_) ImGui::OpenPopup(title_.c_str());
  const auto s = static_cast<float>(scale);
  const ImVec2 all = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowSize({std::min(640 * s, all.x - 20), std::min(480 * s, all.y - 20)});
  ImGui::SetNextWindowPos({0.5f * all.x, 0.5f * all.y}, ImGuiCond_Always, {0.5f, 0.5f});
  if (!ImGui::BeginPopupModal(title_.c_str(), &open_,
                              ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove)) {
    return;
  }
  ImGui::TextDisabled("%s", folder.string().c_str());
  const float below =
      2 * ImGui::GetFrameHeightWithSpacing() + ImGui::GetTextLineHeightWithSpacing();
  ImGui::BeginChild("files", {0, -below}, true);
  if (folder.has_parent_path() && folder != folder.root_path() &&
      ImGui::Selectable("..", false, ImGuiSelectableFlags_DontClosePopups)) {
    enter(folder.parent_path());
  }
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry entry = entries_[i];  // entering a folder makes a new list
    const std::string label = entry.is_folder ? entry.name + "/" : entry.name;
    const bool is_typed = typed_ == entry.name;
    if (ImGui::Selectable(
            label.c_str(), is_typed,
            ImGuiSelectableFlags_AllowDoubleClick | ImGuiSelectableFlags_DontClosePopups)) {
      typed_ = entry.name;
      if (entry.is_folder || ImGui::IsMouseDoubleClicked(0)) {
        enter(entry.name);
        break;
      }
    }
    if (!entry.is_folder) {
      const std::string size = fmt::format("{:.1f} MB", static_cast<double>(entry.bytes) / 1e6);
      ImGui::SameLine(ImGui::GetWindowWidth() - ImGui::CalcTextSize(size.c_str()).x - 24 * s);
      ImGui::TextDisabled("%s", size.c_str());
    }
  }
  if (entries_.empty()) ImGui::TextDisabled("nothing to open here");
  ImGui::EndChild();
  if (problem_.empty()) {
    std::string wanted;
    for (const std::string& suffix : suffixes_) wanted += suffix + " ";
    ImGui::TextDisabled("%s", wanted.c_str());
  } else {
    ImGui::TextColored({1, 0.5f, 0.4f, 1}, "%s", problem_.c_str());
  }
  if (std::exchange(appear_, false)) ImGui::SetKeyboardFocusHere();
  ImGui::SetNextItemWidth(-1);
  const bool entered = ImGui::InputText("##typed", &typed_, ImGuiInputTextFlags_EnterReturnsTrue);
  const bool pressed = ImGui::Button("Open", {110 * s, 0});
  if ((entered || pressed) && !typed_.empty()) enter(typed_);
  ImGui::SameLine();
  if (ImGui::Button("Cancel", {110 * s, 0}) ||
      ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) {
    open_ = false;
  }
  if (!open_) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

}  // namespace haarlight::viewer
