// Cross-section of a rubber door stop: half a disc, flat side up. Lengths in mm.
SetFactory("OpenCASCADE");
radius = 20;
size = 1.5; // length of an element

Point(1) = {-radius, radius, 0, size};
Point(2) = {0, 0, 0, size};
Point(3) = {radius, radius, 0, size};
Point(4) = {0, radius, 0, size}; // centre
Circle(1) = {1, 4, 2};
Circle(2) = {2, 4, 3};
Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3};
Plane Surface(1) = {1};

// Quadrilaterals in place of triangles.
Recombine Surface {1};
Mesh.Algorithm = 1;

// The names that the case uses: the body, the support, the contact surface.
Physical Surface("rubber") = {1};
Physical Curve("top") = {3};
Physical Curve("sole") = {1, 2};
