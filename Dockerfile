# The service and the workers of fieldcal: docker compose up, or docker build -t fieldcal .
FROM python:3.12-slim

WORKDIR /opt/fieldcal
COPY . .
RUN pip install --no-cache-dir -c constraints.txt '.[page,fleet,logs]' \
 && useradd --create-home --uid 1000 fieldcal \
 && install -d -o fieldcal -g fieldcal /srv/fieldcal

USER fieldcal
ENV OMP_NUM_THREADS=1 PYTHONUNBUFFERED=1
VOLUME /srv/fieldcal
EXPOSE 8750
ENTRYPOINT ["fieldcal"]
CMD ["serve", "--listen", "0.0.0.0:8750", "--folder", "/srv/fieldcal"]
