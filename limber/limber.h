// All of limber's library. docs/library.md; a program:
//
//   #include <limber/limber.h>
//   #include <iostream>
//
//   int main() {
//     const limber::Scene scene = limber::read_scene("barriers1", {.preset = "fast"});
//     const limber::Problem problem(scene);
//     const limber::Plan plan = problem.solve({.seed = 1});
//     std::cout << plan.explanation() << '\n';
//     plan.save("out");
//     for (const limber::Promise& promise : limber::verify("out"))
//       std::cout << (promise.kept ? "kept    " : "BROKEN  ") << promise.name << '\n';
//     limber::export_motion("out", {"gltf"});
//   }
#pragma once

#include "limber/authoring.h"
#include "limber/batch.h"
#include "limber/bench.h"
#include "limber/body_folder.h"
#include "limber/edits.h"
#include "limber/exit_codes.h"
#include "limber/farm.h"
#include "limber/film.h"
#include "limber/info.h"
#include "limber/mesh.h"
#include "limber/motion.h"
#include "limber/robust.h"
#include "limber/scene.h"
#include "limber/work_folder.h"
