// A bracket on two pins and the pad that slides on it, as hexahedra: Gmsh 4, `gmsh -3 bracket.geo -o bracket.msh`.
// Lengths in mm; y is up, z across.
SetFactory("OpenCASCADE");
size = 3.3;     // of elements
width = 24;     // of the bracket, z = 0 … 24
layers = 8;     // across
reach = 84;     // from the wall to the tip
height = 66;    // at the wall
tip = 16;       // height at the tip

Mesh.ElementOrder = 1;
Mesh.Algorithm = 8;                  // quadrilaterals that follow the boundary
Mesh.RecombineAll = 1;
Mesh.RecombinationAlgorithm = 1;     // Blossom; a size that leaves no triangle
Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MshFileVersion = 4.1;

// The side view: a wall bracket with a sloping lower edge.
Point(1) = {0, 0, 0};
Point(2) = {24, 0, 0};
Point(3) = {reach, height - tip, 0};
Point(4) = {reach, height, 0};
Point(5) = {0, height, 0};
For i In {1:4}
  Line(i) = {i, i + 1};
EndFor
Line(5) = {5, 1};
Curve Loop(1) = {1, 2, 3, 4, 5};

// The holes of the pins, each in a square that stays solid, of four rows of elements around.
r = 5 / Sqrt(2);
squares() = {};
For pin In {1:2}
  p = 10 * pin;
  y = (pin == 1) ? 12 : height - 18;
  Point(p) = {12, y, 0};
  For i In {0:3}
    dx = (i == 0 || i == 3) ? -1 : 1;
    dy = (i < 2) ? -1 : 1;
    Point(p + 1 + i) = {12 + 8 * dx, y + 8 * dy, 0};
    Point(p + 5 + i) = {12 + r * dx, y + r * dy, 0};
    Line(100 * pin + i) = {p + 1 + i, p + 5 + i};
  EndFor
  For i In {0:3}
    j = (i + 1) % 4;
    Line(100 * pin + 10 + i) = {p + 1 + i, p + 1 + j};
    Circle(100 * pin + 20 + i) = {p + 5 + i, p, p + 5 + j};
    Curve Loop(100 * pin + i) = {100 * pin + 10 + i, 100 * pin + j, -(100 * pin + 20 + i), -(100 * pin + i)};
    Plane Surface(100 * pin + i) = {100 * pin + i};
    Transfinite Curve{100 * pin + i} = 3;
    Transfinite Curve{100 * pin + 10 + i, 100 * pin + 20 + i} = 6;
    Transfinite Surface{100 * pin + i};
    squares() += {100 * pin + i};
  EndFor
  Curve Loop(10 * pin) = {100 * pin + 10, 100 * pin + 11, 100 * pin + 12, 100 * pin + 13};
EndFor
Plane Surface(1) = {1, 10, 20};
Extrude {0, 0, width} { Surface{1, squares()}; Layers{layers}; Recombine; }

// The pad: a block on the shelf, narrower than it, with a crowned sole that does not run on its edges.
start = 22;     // its first x
length = 18;    // along the shelf
crown = 1;      // of the sole
Point(501) = {start, height + crown, 4};
Point(502) = {start + length, height + crown, 4};
Point(503) = {start + length, height + 9, 4};
Point(504) = {start, height + 9, 4};
Point(505) = {start + length / 2, height, 4};
Spline(501) = {501, 505, 502};
Line(502) = {502, 503};
Line(503) = {503, 504};
Line(504) = {504, 501};
Transfinite Curve{501, 503} = 10;
Transfinite Curve{502, 504} = 4;
Curve Loop(501) = {501, 502, 503, 504};
Plane Surface(500) = {501};
Transfinite Surface{500};
pad[] = Extrude {0, 0, width - 8} { Surface{500}; Layers{6}; Recombine; };

// Names. A set `shelf` on the bracket is `bracket_shelf` in the case.
e = 0.001;
bodies() = Volume{:};
bodies() -= {pad[1]};
Physical Volume("bracket") = {bodies()};
Physical Volume("pad") = {pad[1]};
Physical Surface("shelf") = Surface In BoundingBox {-e, height - e, -e, reach + e, height + e, width + e};
lower() = Surface In BoundingBox {7 - e, 7 - e, -e, 17 + e, 17 + e, width + e};
upper() = Surface In BoundingBox {7 - e, height - 23 - e, -e, 17 + e, height - 13 + e, width + e};
Physical Surface("pins") = {lower(), upper()};
Physical Surface("sole") = {pad[2]};
Physical Surface("grip") = {pad[4]};
