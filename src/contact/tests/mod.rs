mod admittance;
